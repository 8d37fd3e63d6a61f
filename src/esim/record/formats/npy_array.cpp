#include "esim/record/formats/npy_array.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>
#include <optional>
#include <utility>

#include "esim/core/error.h"

namespace esim::npy {
namespace {

constexpr std::size_t kHeaderBytes = 192;
constexpr std::size_t kMaxHeaderBytes = 1 << 16, kMaxItemBytes = 1 << 16;
constexpr int kMaxDepth = 8;

std::string padded_header(const std::string& description) {
  const auto length = static_cast<std::uint16_t>(kHeaderBytes - kMagic.size() - 4);
  std::string text(kMagic);
  text += {'\1', '\0', static_cast<char>(length & 0xFF), static_cast<char>(length >> 8)};
  text += description;
  text.resize(kHeaderBytes - 1, ' ');
  return text + '\n';
}

/// A Python literal: a text, a word, or a sequence of literals. Of dictionaries, keys and values in turn.
struct Literal {
  std::string text{};
  bool sequence = false;
  std::vector<Literal> items{};
};

/// Leaves what follows the literal; nothing where there is none.
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

std::optional<std::uint64_t> natural(std::string_view text) {
  std::uint64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

/// Of "<i8", "|u1", "<m8[us]"; nothing for what has no such type.
std::optional<Field> field_of(std::string_view type) {
  if (type.size() < 3) return std::nullopt;
  Field field;
  field.big_endian = type[0] == '>';
  field.kind = type[1];
  const std::size_t unit = std::min(type.find('['), type.size());
  const auto size = natural(type.substr(2, unit - 2));
  if (!size || *size > kMaxItemBytes) return std::nullopt;
  field.bytes = field.kind == 'U' ? 4 * *size : *size;
  const std::string_view name = type.substr(unit);
  field.unit = name == "[ns]"   ? 1
               : name == "[us]" ? kNsPerUs
               : name == "[ms]" ? kNsPerMs
               : name == "[s]"  ? kNsPerSecond
                                : 0;
  const bool integer = field.bytes == 1 || field.bytes == 2 || field.bytes == 4 || field.bytes == 8;
  const bool readable = ((field.kind == 'i' || field.kind == 'u') && integer) ||
                        (field.kind == 'b' && field.bytes == 1) ||
                        (field.kind == 'f' && (field.bytes == 4 || field.bytes == 8)) ||
                        ((field.kind == 'm' || field.kind == 'M') && field.bytes == 8 && field.unit > 0);
  if (!readable) field.kind = 'V';
  return field;
}

/// How many numbers an array has.
struct Count {
  std::uint64_t numbers = 1;
  bool one_dimension = true;  ///< that matters
};

/// Nothing where it is no shape, or where the numbers cannot be counted.
std::optional<Count> count_of(const Literal& shape) {
  if (!shape.sequence) return std::nullopt;
  Count count;
  for (const Literal& item : shape.items) {
    const auto extent = natural(item.text);
    if (!extent) return std::nullopt;
    count.one_dimension = count.one_dimension && (*extent == 1 || count.numbers == 1);
    if (__builtin_mul_overflow(count.numbers, *extent, &count.numbers)) return std::nullopt;
  }
  return count;
}

template <typename Number>
Number load(const std::byte* from, bool big_endian) {
  std::byte bytes[sizeof(Number)];
  std::memcpy(bytes, from, sizeof(Number));
  if (big_endian) std::reverse(std::begin(bytes), std::end(bytes));
  Number value;
  std::memcpy(&value, bytes, sizeof(Number));
  return value;
}

/// Calls take(value) for the field in each item.
template <typename Number, typename Take>
void for_each(const Field& field, std::size_t stride, std::span<const std::byte> items, const Take& take) {
  for (std::size_t at = field.offset; at < items.size(); at += stride) take(load<Number>(&items[at], field.big_endian));
}

/// As above, of whichever type the field is.
template <typename Take>
void for_each_number(const Field& field, std::size_t stride, std::span<const std::byte> items, const Take& take) {
  const auto visit = [&](auto zero) { for_each<decltype(zero)>(field, stride, items, take); };
  const bool is_signed = field.kind == 'i' || field.kind == 'm' || field.kind == 'M';
  if (field.kind == 'f') return field.bytes == 4 ? visit(float{}) : visit(double{});
  switch (field.bytes) {
    case 1:
      return is_signed ? visit(std::int8_t{}) : visit(std::uint8_t{});
    case 2:
      return is_signed ? visit(std::int16_t{}) : visit(std::uint16_t{});
    case 4:
      return is_signed ? visit(std::int32_t{}) : visit(std::uint32_t{});
    default:
      return is_signed ? visit(std::int64_t{}) : visit(std::uint64_t{});
  }
}

template <typename Number>
std::int64_t integer(Number value) {
  if constexpr (std::is_floating_point_v<Number>) {
    constexpr Number kMost = 1 << 30;
    return std::abs(value) < kMost && value == std::trunc(value) ? static_cast<std::int64_t>(value) : Array::kNoNumber;
  } else {
    return std::in_range<std::int64_t>(value) ? static_cast<std::int64_t>(value) : Array::kNoNumber;
  }
}

}  // namespace

std::string_view time_type(TimeUnit unit) { return unit == TimeUnit::us ? "<i8" : "<m8[ns]"; }

std::string header_text(std::string_view descr, std::uint64_t count) {
  return padded_header(fmt::format("{{'descr': {}, 'fortran_order': False, 'shape': ({},), }}", descr, count));
}

std::string scalar_header_text(std::string_view descr) {
  return padded_header(fmt::format("{{'descr': {}, 'fortran_order': False, 'shape': (), }}", descr));
}

Array::Array(std::string name, Read read) : name_(std::move(name)), read_(std::move(read)) {
  // The version decides on the length of the length.
  std::byte start[12];
  const std::span<std::byte> first(start, 10);
  if (read_(first) < first.size() || std::memcmp(start, kMagic.data(), kMagic.size()) != 0) {
    fail("it does not begin as NumPy's files do");
  }
  const bool short_length = start[6] == std::byte{1};
  if (!short_length && read_({start + 10, 2}) < 2) fail("it ends within its header");
  const std::size_t length =
      short_length ? load<std::uint16_t>(start + 8, false) : load<std::uint32_t>(start + 8, false);
  if (length > kMaxHeaderBytes) fail(fmt::format("its header of {} bytes is too long", length));
  std::string description(length, '\0');
  if (read_(std::as_writable_bytes(std::span(description))) < length) fail("it ends within its header");
  parse(description);
}

void Array::fail(const std::string& what) const { throw UserError(fmt::format("cannot read {}: {}", name_, what)); }

void Array::parse(std::string_view description) {
  const auto dictionary = take_literal(description);
  if (!dictionary || dictionary->items.size() % 2 != 0) fail("its header is damaged");
  const Literal* descr = nullptr;
  std::optional<Count> count;
  for (std::size_t i = 0; i < dictionary->items.size(); i += 2) {
    if (dictionary->items[i].text == "descr") descr = &dictionary->items[i + 1];
    if (dictionary->items[i].text == "shape") count = count_of(dictionary->items[i + 1]);
  }
  if (descr == nullptr || !count) fail("its header is damaged");
  count_ = count->numbers;
  one_dimension_ = count->one_dimension;

  const auto add = [&](const Literal& type, std::string name, std::uint64_t repeats) {
    auto field = type.sequence ? std::nullopt : field_of(type.text);
    if (!field) fail(fmt::format("field \"{}\" is of a type that is not supported: {}", name, type.text));
    field->name = std::move(name);
    field->offset = item_bytes_;
    if (repeats != 1) field->kind = 'V';
    if (repeats > kMaxItemBytes || field->bytes * repeats > kMaxItemBytes - item_bytes_)
      fail("its items are too large");
    item_bytes_ += field->bytes * repeats;
    fields_.push_back(*field);
  };
  if (!descr->sequence) {
    fields_ = {field_of(descr->text).value_or(Field{.kind = 'V', .bytes = 1})};
    item_bytes_ = fields_[0].bytes;
  } else {
    for (const Literal& item : descr->items) {
      if (item.items.size() < 2) fail("its header is damaged");
      const Literal& name = item.items[0];  // or title and name
      const auto repeats = item.items.size() > 2 ? count_of(item.items[2]) : Count{};
      if (!repeats) fail("its header is damaged");
      add(item.items[1], name.sequence && !name.items.empty() ? name.items.back().text : name.text, repeats->numbers);
    }
  }
  if (item_bytes_ == 0) fail("its items are empty");
}

std::size_t Array::advance(std::size_t count) {
  items_.resize(count * item_bytes_);
  held_ = read_(items_) / item_bytes_;
  return held_;
}

void Array::integers(const Field& field, std::vector<std::int64_t>& out) const {
  out.clear();
  out.reserve(held_);
  for_each_number(field, item_bytes_, std::span(items_).first(held_ * item_bytes_),
                  [&](auto value) { out.push_back(integer(value)); });
}

void Array::times(const Field& field, std::vector<std::int64_t>& out) const {
  if (field.kind == 'f') {
    constexpr double kMost = 9e9;  // s; more is no int64 of ns
    out.clear();
    out.reserve(held_);
    for_each_number(field, item_bytes_, std::span(items_).first(held_ * item_bytes_), [&](auto value) {
      const auto seconds = static_cast<double>(value);
      out.push_back(std::abs(seconds) < kMost ? to_ns(seconds) : kNoNumber);
    });
    return;
  }
  integers(field, out);
  const TimeNs unit = field.unit > 0 ? field.unit : kNsPerUs;
  for (std::int64_t& t : out) {
    if (__builtin_mul_overflow(t, unit, &t)) t = kNoNumber;
  }
}

}  // namespace esim::npy
