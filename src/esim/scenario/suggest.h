#pragma once

#include <string>
#include <vector>

namespace esim {

/// The candidate that a person most likely meant by `word` (least edit distance); empty where none is near.
std::string nearest(const std::string& word, const std::vector<std::string>& candidates);

/// "a, b, c".
std::string list(const std::vector<std::string>& words);

}  // namespace esim
