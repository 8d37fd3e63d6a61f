#include "esim/files/npy_header.h"

#include <algorithm>
#include <charconv>
#include <utility>

namespace esim::inline files::npy {
namespace {

constexpr std::size_t kHeaderBytes = 192;
constexpr std::size_t kMaxHeaderBytes = 1 << 16;
constexpr int kMaxDepth = 8;

/// Removes a literal from the start of `source`; nothing if there is no literal.
std::optional<Literal> take_literal(std::string_view& source, int depth = 0) {
  const auto skip = [&](std::string_view these) {
    source.remove_prefix(std::min(source.find_first_not_of(these), source.size()));
  };
  skip(" \n");
  if (source.empty() || depth > kMaxDepth) return std::nullopt;
  Literal literal;
  const char first = source.front();
  if (first == '\'' || first == '"') {
    const std::size_t end = source.find(first, 1);
    if (end == std::string_view::npos) return std::nullopt;
    literal.text = source.substr(1, end - 1);
    source.remove_prefix(end + 1);
    return literal;
  }
  if (first == '(' || first == '[' || first == '{') {
    literal.sequence = true;
    source.remove_prefix(1);
    for (skip(" \n,:"); !source.empty(); skip(" \n,:")) {
      if (std::string_view(")]}").find(source.front()) != std::string_view::npos) {
        source.remove_prefix(1);
        return literal;
      }
      auto item = take_literal(source, depth + 1);
      if (!item) return std::nullopt;
      literal.items.push_back(std::move(*item));
    }
    return std::nullopt;
  }
  const std::size_t end = std::min(source.find_first_of(" \n,:()[]{}"), source.size());
  if (end == 0) return std::nullopt;
  literal.text = source.substr(0, end);
  source.remove_prefix(end);
  return literal;
}

}  // namespace

std::string header_text(std::string_view descr, std::span<const std::uint64_t> shape) {
  const auto length = static_cast<std::uint16_t>(kHeaderBytes - kMagic.size() - 4);
  std::string text(kMagic);
  text += {'\1', '\0', static_cast<char>(length & 0xFF), static_cast<char>(length >> 8)};
  text += "{'descr': " + std::string(descr) + ", 'fortran_order': False, 'shape': (";
  for (std::size_t i = 0; i < shape.size(); ++i) text += (i > 0 ? ", " : "") + std::to_string(shape[i]);
  text += shape.size() == 1 ? ",), }" : "), }";
  text.resize(kHeaderBytes - 1, ' ');
  return text + '\n';
}

std::optional<std::vector<std::uint64_t>> shape_of(const Literal& literal) {
  if (!literal.sequence) return std::nullopt;
  std::vector<std::uint64_t> shape;
  for (const Literal& item : literal.items) {
    const char* const end = item.text.data() + item.text.size();
    const auto [stop, error] = std::from_chars(item.text.data(), end, shape.emplace_back());
    if (error != std::errc() || stop != end) return std::nullopt;
  }
  return shape;
}

Header read_header(const Read& read, const Fail& fail) {
  const auto take = [&](std::size_t bytes) {
    std::string text(bytes, '\0');
    if (read(std::as_writable_bytes(std::span(text))) < bytes) fail("it ends within its header");
    return text;
  };
  if (take(kMagic.size()) != kMagic) fail("it does not begin with NumPy's magic bytes");
  const bool first_version = take(2)[0] == 1;  // the length field has two bytes in version 1, four in later ones
  const std::string digits = take(first_version ? 2 : 4);
  std::size_t length = 0;
  for (std::size_t i = 0; i < digits.size(); ++i) length |= std::size_t{static_cast<unsigned char>(digits[i])} << 8 * i;
  if (length > kMaxHeaderBytes) fail("its header of " + std::to_string(length) + " bytes is too long");

  const std::string description = take(length);
  std::string_view rest = description;
  auto dictionary = take_literal(rest);
  if (!dictionary || dictionary->items.size() % 2 != 0) fail("its header is damaged");
  Header header;
  bool typed = false, ordered = false;
  std::optional<std::vector<std::uint64_t>> shape;
  for (std::size_t i = 0; i < dictionary->items.size(); i += 2) {
    const std::string& key = dictionary->items[i].text;
    Literal& value = dictionary->items[i + 1];
    if (key == "shape") shape = shape_of(value);
    if (key == "fortran_order") header.fortran_order = value.text != "False", ordered = true;
    if (key == "descr") header.descr = std::move(value), typed = true;
  }
  if (!typed || !ordered) fail("its header is damaged");
  if (!shape) fail("its shape is invalid");
  header.shape = std::move(*shape);
  return header;
}

}  // namespace esim::inline files::npy
