#include "esim/core/npy_description.h"

#include <algorithm>
#include <charconv>

#include "esim/core/error.h"

namespace esim {
namespace {

/// What follows 'key': in the dictionary.
std::string_view value_of(std::string_view text, const std::string& key) {
  const std::string quoted = "'" + key + "'";
  const std::size_t at = text.find(quoted),
                    colon = text.find(':', at == std::string_view::npos ? at : at + quoted.size());
  if (at == std::string_view::npos || colon == std::string_view::npos)
    throw UserError("its header does not tell the " + key);
  text.remove_prefix(colon + 1);
  text.remove_prefix(std::min(text.find_first_not_of(' '), text.size()));
  return text;
}

std::uint64_t extent_of(std::string_view word) {
  std::uint64_t extent = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), extent);
  if (error != std::errc() || end != word.data() + word.size()) throw UserError("its shape is none");
  return extent;
}

}  // namespace

NpyDescription parse_npy_description(std::string_view dictionary) {
  NpyDescription description;
  if (!value_of(dictionary, "fortran_order").starts_with("False")) throw UserError("it is not in C order");
  const std::string_view type = value_of(dictionary, "descr"), shape = value_of(dictionary, "shape");
  if (!type.starts_with('\'') || type.find('\'', 1) == std::string_view::npos)
    throw UserError("its type is not one of numbers");
  description.type = type.substr(1, type.find('\'', 1) - 1);
  if (!shape.starts_with('(') || shape.find(')') == std::string_view::npos) throw UserError("its shape is none");
  for (std::string_view rest = shape.substr(1, shape.find(')') - 1); !rest.empty();) {
    std::string_view word = rest.substr(0, rest.find(','));
    rest.remove_prefix(std::min(word.size() + 1, rest.size()));
    word.remove_prefix(std::min(word.find_first_not_of(' '), word.size()));
    word = word.substr(0, word.find(' '));
    if (!word.empty()) description.shape.push_back(extent_of(word));
  }
  return description;
}

}  // namespace esim
