#include "esim/record/formats/npy_header.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>

#include "esim/record/number_text.h"

namespace esim {
namespace {

constexpr std::string_view kMagic = "\x93NUMPY";
constexpr std::size_t kHeaderBytes = 128, kPrefixBytes = 10;

/// What follows 'key': in the dictionary.
std::string_view value_of(const InputFile& file, std::string_view text, std::string_view key) {
  const std::string quoted = fmt::format("'{}'", key);
  const std::size_t at = text.find(quoted),
                    colon = text.find(':', at == std::string_view::npos ? at : at + quoted.size());
  if (at == std::string_view::npos || colon == std::string_view::npos)
    file.fail(0, fmt::format("its header does not tell the {}", key));
  text.remove_prefix(colon + 1);
  text.remove_prefix(std::min(text.find_first_not_of(' '), text.size()));
  return text;
}

}  // namespace

std::string npy_header(std::string_view type, std::span<const std::uint64_t> shape) {
  std::string extents;
  for (const std::uint64_t extent : shape) extents += (extents.empty() ? "" : ", ") + std::to_string(extent);
  if (shape.size() == 1) extents += ",";
  std::string text = fmt::format("{{'descr': '{}', 'fortran_order': False, 'shape': ({}), }}", type, extents);
  text.resize(kHeaderBytes - kPrefixBytes - 1, ' ');
  std::string header(kMagic);
  header += {'\x01', '\x00', static_cast<char>(kHeaderBytes - kPrefixBytes), '\x00'};
  return header + text + "\n";
}

NpyHeader read_npy_header(InputFile& file) {
  constexpr std::size_t kMaxBytes = 1 << 16;
  const auto prefix = file.read_exactly(kMagic.size() + 2, "the header");
  if (!std::equal(kMagic.begin(), kMagic.end(), reinterpret_cast<const char*>(prefix.data())))
    file.fail(0, "it is no NumPy array file");
  const std::size_t length_bytes = prefix[kMagic.size()] == std::byte{1} ? 2 : 4;
  std::size_t length = 0;
  const auto digits = file.read_exactly(length_bytes, "the header");
  for (std::size_t i = 0; i < length_bytes; ++i) length |= std::to_integer<std::size_t>(digits[i]) << 8 * i;
  if (length > kMaxBytes) file.fail(kMagic.size() + 2, fmt::format("a header of {} bytes is none", length));
  const auto bytes = file.read_exactly(length, "the header");
  const std::string text(reinterpret_cast<const char*>(bytes.data()), bytes.size());

  NpyHeader header;
  if (!value_of(file, text, "fortran_order").starts_with("False")) file.fail(0, "it is not in C order");
  const std::string_view type = value_of(file, text, "descr"), shape = value_of(file, text, "shape");
  if (!type.starts_with('\'') || type.find('\'', 1) == std::string_view::npos)
    file.fail(0, "its type is not one of numbers");
  header.type = type.substr(1, type.find('\'', 1) - 1);
  if (!shape.starts_with('(') || shape.find(')') == std::string_view::npos) file.fail(0, "its shape is none");
  for (std::string_view rest = shape.substr(1, shape.find(')') - 1); !rest.empty();) {
    std::string_view word = rest.substr(0, rest.find(','));
    rest.remove_prefix(std::min(word.size() + 1, rest.size()));
    word = take_word(word);
    if (word.empty()) continue;
    if (!parse_number(word, header.shape.emplace_back())) file.fail(0, "its shape is none");
  }
  return header;
}

}  // namespace esim
