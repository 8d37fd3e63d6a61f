#include "esim/formats/numpy/npy_array.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <optional>
#include <utility>

#include "esim/core/error.h"
#include "esim/core/load_unaligned.h"
#include "esim/files/number_text.h"

namespace esim::inline formats::numpy {
namespace {

constexpr std::size_t kMaxItemBytes = 1 << 16;

/// The field of "<i8", "|u1", "<m8[us]"; nothing for other types.
std::optional<Field> field_of(std::string_view type) {
  if (type.size() < 3) return std::nullopt;
  Field field;
  field.big_endian = type[0] == '>';
  field.kind = type[1];
  const std::size_t unit = std::min(type.find('['), type.size());
  std::uint64_t size = 0;
  if (!parse_number(type.substr(2, unit - 2), size) || size > kMaxItemBytes) return std::nullopt;
  field.bytes = field.kind == 'U' ? 4 * size : size;
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

/// The number of numbers in an array.
struct Count {
  std::uint64_t numbers = 1;
  bool one_dimension = true;  ///< or one item only
};

/// Nothing if the numbers cannot be counted.
std::optional<Count> count_of(const std::vector<std::uint64_t>& shape) {
  Count count;
  for (const std::uint64_t extent : shape) {
    count.one_dimension = count.one_dimension && (extent == 1 || count.numbers == 1);
    if (__builtin_mul_overflow(count.numbers, extent, &count.numbers)) return std::nullopt;
  }
  return count;
}

template <typename Number>
Number load(const std::byte* from, bool big_endian) {
  std::byte bytes[sizeof(Number)];
  std::memcpy(bytes, from, sizeof(Number));
  if (big_endian) std::reverse(std::begin(bytes), std::end(bytes));
  return load_unaligned<Number>(bytes);
}

/// Calls take(value) with the field of each item.
template <typename Number, typename Take>
void for_each(const Field& field, std::size_t stride, std::span<const std::byte> items, const Take& take) {
  for (std::size_t at = field.offset; at < items.size(); at += stride) take(load<Number>(&items[at], field.big_endian));
}

/// The same for a field of any type.
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
    constexpr Number kMax = 1 << 30;
    return std::abs(value) < kMax && value == std::trunc(value) ? static_cast<std::int64_t>(value) : Array::kNoNumber;
  } else {
    return std::in_range<std::int64_t>(value) ? static_cast<std::int64_t>(value) : Array::kNoNumber;
  }
}

}  // namespace

std::string_view time_type(TimeUnit unit) { return unit == TimeUnit::us ? "<i8" : "<m8[ns]"; }

Array::Array(std::string name, Read read) : name_(std::move(name)), read_(std::move(read)) {
  const npy::Header header = npy::read_header(read_, [this](const std::string& problem) { fail(problem); });
  const auto count = count_of(header.shape);
  if (!count) fail("its header is damaged");
  count_ = count->numbers;
  one_dimension_ = count->one_dimension;
  take_fields(header.descr);
}

void Array::fail(const std::string& what) const { throw UserError(fmt::format("cannot read {}: {}", name_, what)); }

void Array::take_fields(const npy::Literal& descr) {
  const auto add = [&](const npy::Literal& type, std::string name, std::uint64_t repeats) {
    auto field = type.sequence ? std::nullopt : field_of(type.text);
    if (!field) fail(fmt::format("field \"{}\" has a type that is not supported: {}", name, type.text));
    field->name = std::move(name);
    field->offset = item_bytes_;
    if (repeats != 1) field->kind = 'V';
    if (repeats > kMaxItemBytes || field->bytes * repeats > kMaxItemBytes - item_bytes_)
      fail("its items are too large");
    item_bytes_ += field->bytes * repeats;
    fields_.push_back(*field);
  };
  if (!descr.sequence) {
    fields_ = {field_of(descr.text).value_or(Field{.kind = 'V', .bytes = 1})};
    item_bytes_ = fields_[0].bytes;
  } else {
    for (const npy::Literal& item : descr.items) {
      if (item.items.size() < 2) fail("its header is damaged");
      const npy::Literal& name = item.items[0];  // or title and name
      const auto shape = item.items.size() > 2 ? npy::shape_of(item.items[2]) : std::vector<std::uint64_t>{};
      const auto repeats = shape ? count_of(*shape) : std::nullopt;
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

void Array::floats(const Field& field, std::vector<float>& out) const {
  out.clear();
  out.reserve(held_);
  for_each_number(field, item_bytes_, std::span(items_).first(held_ * item_bytes_),
                  [&](auto value) { out.push_back(static_cast<float>(value)); });
}

void Array::times(const Field& field, std::vector<std::int64_t>& out) const {
  if (field.kind == 'f') {
    constexpr double kMax = 9e9;  // larger times do not fit into int64 ns
    out.clear();
    out.reserve(held_);
    for_each_number(field, item_bytes_, std::span(items_).first(held_ * item_bytes_), [&](auto value) {
      const auto seconds = static_cast<double>(value);
      out.push_back(std::abs(seconds) < kMax ? to_ns(seconds) : kNoNumber);
    });
    return;
  }
  integers(field, out);
  const TimeNs unit = field.unit > 0 ? field.unit : kNsPerUs;
  for (std::int64_t& t : out) {
    if (__builtin_mul_overflow(t, unit, &t)) t = kNoNumber;
  }
}

}  // namespace esim::inline formats::numpy
