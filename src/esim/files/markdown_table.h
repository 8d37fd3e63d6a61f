#pragma once

#include <string>
#include <vector>

namespace esim::inline files {

/// A table of Markdown, with aligned columns. The first row is its head; missing cells are empty.
std::string markdown_table(const std::vector<std::vector<std::string>>& rows);

}  // namespace esim::inline files
