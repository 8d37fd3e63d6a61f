#pragma once

#include <string>
#include <vector>

namespace esim::inline scenario {

/// The candidate with the smallest edit distance to `word`; empty if none is similar.
std::string nearest(const std::string& word, const std::vector<std::string>& candidates);

/// "a, b, c".
std::string list(const std::vector<std::string>& words);

}  // namespace esim::inline scenario
