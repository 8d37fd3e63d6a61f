#include "esim/scene/splats/ply_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cstring>
#include <limits>
#include <utility>

#include "esim/core/inputs/used_files.h"
#include "esim/scene/splats/splat_list.h"

namespace esim::inline scene {
namespace {

static_assert(std::endian::native == std::endian::little);

constexpr std::size_t kMaxLine = 1 << 16, kMaxHeaderLines = 1 << 14, kBlockBytes = 1 << 18;

std::size_t bytes_of(PlyType type) {
  switch (type) {
    case PlyType::int8:
    case PlyType::uint8:
      return 1;
    case PlyType::int16:
    case PlyType::uint16:
      return 2;
    case PlyType::int32:
    case PlyType::uint32:
    case PlyType::float32:
      return 4;
    case PlyType::float64:
      return 8;
  }
  return 0;
}

std::optional<PlyType> type_named(std::string_view name) {
  static constexpr std::pair<std::string_view, PlyType> kNames[] = {
      {"char", PlyType::int8},      {"int8", PlyType::int8},       {"uchar", PlyType::uint8},
      {"uint8", PlyType::uint8},    {"short", PlyType::int16},     {"int16", PlyType::int16},
      {"ushort", PlyType::uint16},  {"uint16", PlyType::uint16},   {"int", PlyType::int32},
      {"int32", PlyType::int32},    {"uint", PlyType::uint32},     {"uint32", PlyType::uint32},
      {"float", PlyType::float32},  {"float32", PlyType::float32}, {"double", PlyType::float64},
      {"float64", PlyType::float64}};
  for (const auto& [known, type] : kNames) {
    if (name == known) return type;
  }
  return std::nullopt;
}

template <typename T>
double load(const std::byte* from, bool swapped) {
  std::array<std::byte, sizeof(T)> bytes;
  std::memcpy(bytes.data(), from, sizeof(T));
  if (swapped) std::reverse(bytes.begin(), bytes.end());
  return static_cast<double>(std::bit_cast<T>(bytes));
}

double number(const std::byte* from, PlyType type, bool swapped) {
  switch (type) {
    case PlyType::int8:
      return load<std::int8_t>(from, swapped);
    case PlyType::uint8:
      return load<std::uint8_t>(from, swapped);
    case PlyType::int16:
      return load<std::int16_t>(from, swapped);
    case PlyType::uint16:
      return load<std::uint16_t>(from, swapped);
    case PlyType::int32:
      return load<std::int32_t>(from, swapped);
    case PlyType::uint32:
      return load<std::uint32_t>(from, swapped);
    case PlyType::float32:
      return load<float>(from, swapped);
    case PlyType::float64:
      return load<double>(from, swapped);
  }
  return 0;
}

/// Splits off the next word of a line; empty at its end.
std::string_view next_word(std::string_view& line) {
  const std::size_t begin = std::min(line.find_first_not_of(" \t"), line.size());
  line.remove_prefix(begin);
  const std::string_view word = line.substr(0, line.find_first_of(" \t"));
  line.remove_prefix(word.size());
  return word;
}

/// The bytes of a row; none if their number varies, because it contains lists.
std::optional<std::uint64_t> row_bytes(const PlyElement& element) {
  std::uint64_t bytes = 0;
  for (const PlyProperty& property : element.properties) {
    if (property.list) return std::nullopt;
    bytes += bytes_of(property.type);
  }
  return bytes;
}

/// Reads the lines of a header, between the first one and end_header.
class HeaderReader {
 public:
  explicit HeaderReader(const std::filesystem::path& path) : file_(path) {}

  PlyHeader read() {
    constexpr std::size_t kMaxLines = kMaxHeaderLines;
    if (line() != "ply") fail("must begin with 'ply'");
    for (std::size_t i = 0; i < kMaxLines; ++i) {
      std::string_view rest = line();
      const std::string_view key = next_word(rest);
      if (key == "end_header") {
        if (!has_format_) fail("the line 'format' is missing");
        header_.bytes = file_.offset();
        return std::move(header_);
      }
      if (key == "format") read_format(next_word(rest));
      if (key == "comment" || key == "obj_info") header_.comments.emplace_back(rest);
      if (key == "element") read_element(rest);
      if (key == "property") read_property(rest);
    }
    fail(fmt::format("the header has more than {} lines", kMaxLines));
  }

 private:
  [[noreturn]] void fail(const std::string& reason) const { file_.fail(start_, reason + "; export the PLY again"); }

  std::string_view line() {
    start_ = file_.offset();
    if (start_ >= file_.size()) fail("the file ends within its header");
    return file_.read_line(kMaxLine, "a line of the PLY header");
  }

  void read_format(std::string_view name) {
    has_format_ = true;
    if (name == "ascii") {
      header_.encoding = PlyEncoding::ascii;
    } else if (name == "binary_little_endian") {
      header_.encoding = PlyEncoding::little_endian;
    } else if (name == "binary_big_endian") {
      header_.encoding = PlyEncoding::big_endian;
    } else {
      fail("format must be ascii, binary_little_endian or binary_big_endian");
    }
  }

  void read_element(std::string_view rest) {
    PlyElement element{std::string(next_word(rest))};
    const std::string_view count = next_word(rest);
    const auto [end, error] = std::from_chars(count.data(), count.data() + count.size(), element.count);
    if (error != std::errc() || end != count.data() + count.size() || count.empty())
      fail("the number of an element must be an integer from 0");
    header_.elements.push_back(std::move(element));
  }

  void read_property(std::string_view rest) {
    if (header_.elements.empty()) fail("a property must follow an element");
    PlyProperty property;
    std::string_view type = next_word(rest);
    if (type == "list") {
      property.list = true;
      next_word(rest);  // type of the length
      type = next_word(rest);
    }
    const std::optional<PlyType> known = type_named(type);
    property.name = next_word(rest);
    if (!known || property.name.empty()) fail("a property must have a type, such as float, and a name");
    property.type = *known;
    header_.elements.back().properties.push_back(std::move(property));
  }

  InputFile file_;
  PlyHeader header_;
  std::uint64_t start_ = 0;  // of the line
  bool has_format_ = false;
};

}  // namespace

std::optional<std::size_t> PlyElement::find(std::string_view property) const {
  const auto found = std::find_if(properties.begin(), properties.end(),
                                  [&](const PlyProperty& p) { return p.name == property && !p.list; });
  if (found == properties.end()) return std::nullopt;
  return static_cast<std::size_t>(found - properties.begin());
}

const PlyElement* PlyHeader::find(std::string_view element) const {
  const auto found =
      std::find_if(elements.begin(), elements.end(), [&](const PlyElement& e) { return e.name == element; });
  return found == elements.end() ? nullptr : &*found;
}

PlyHeader read_ply_header(const std::filesystem::path& file) {
  note_used(file);
  return HeaderReader(file).read();
}

PlyRows::PlyRows(const std::filesystem::path& file, const PlyHeader& header, const PlyElement& element,
                 const std::vector<std::string>& properties)
    : file_(file),
      encoding_(header.encoding),
      name_(element.name),
      count_(element.count),
      words_(element.properties.size()),
      values_(properties.size()) {
  for (const std::string& name : properties) {
    const std::optional<std::size_t> index = element.find(name);
    if (!index) fail_splats(file, fmt::format("the property {} of the element {} is missing", name, name_));
    Column column{*index, element.properties[*index].type};
    if (encoding_ != PlyEncoding::ascii) {
      column.offset = 0;
      for (std::size_t i = 0; i < *index; ++i) column.offset += bytes_of(element.properties[i].type);
    }
    columns_.push_back(column);
  }

  // Finds the first row, behind the elements before this one.
  std::uint64_t at = header.bytes, lines = 0;
  const auto check = [&](const PlyElement& rows) {
    const std::optional<std::uint64_t> bytes = row_bytes(rows);
    if (!bytes) fail_splats(file, fmt::format("the element {} has lists, which are not supported here", rows.name));
    // In ASCII, a row has at least a digit and a space or a line end per property.
    const std::uint64_t least = encoding_ == PlyEncoding::ascii ? 2 * rows.properties.size() : *bytes;
    const std::uint64_t left = file_.size() - at + (encoding_ == PlyEncoding::ascii ? 1 : 0);
    if (least > 0 && rows.count > left / least)
      file_.fail(file_.size(),
                 fmt::format("the file ends within row {} of {} of the element {}; copy or export it again",
                             left / least + 1, rows.count, rows.name));
    return *bytes;
  };
  for (const PlyElement& before : header.elements) {
    if (&before == &element) break;
    const std::uint64_t bytes = check(before);
    if (encoding_ == PlyEncoding::ascii && !before.properties.empty()) lines += before.count;
    if (encoding_ != PlyEncoding::ascii) at += before.count * bytes;
  }
  row_bytes_ = static_cast<std::size_t>(check(element));
  file_.seek(at);
  for (std::uint64_t i = 0; i < lines; ++i) next_line();
}

const std::vector<double>& PlyRows::next() {
  ++row_;
  if (encoding_ == PlyEncoding::ascii) {
    next_line();
    for (std::size_t i = 0; i < columns_.size(); ++i) values_[i] = line_[columns_[i].offset];
    return values_;
  }
  if (at_ >= block_.size()) next_block();
  const std::byte* const row = block_.data() + at_;
  at_ += row_bytes_;
  const bool swapped = encoding_ == PlyEncoding::big_endian;
  for (std::size_t i = 0; i < columns_.size(); ++i)
    values_[i] = number(row + columns_[i].offset, columns_[i].type, swapped);
  return values_;
}

void PlyRows::next_block() {
  const std::uint64_t left = count_ - (row_ - 1);
  const std::size_t rows = static_cast<std::size_t>(
      std::min<std::uint64_t>(left, std::max<std::size_t>(kBlockBytes / std::max<std::size_t>(row_bytes_, 1), 1)));
  block_ = file_.read_exactly(rows * row_bytes_, "the element " + name_);
  at_ = 0;
}

void PlyRows::next_line() {
  const std::uint64_t start = file_.offset();
  if (start >= file_.size())
    file_.fail(start, fmt::format("the file ends within the element {}; copy or export it again", name_));
  std::string_view rest = file_.read_line(kMaxLine, "a line");
  line_.clear();
  for (std::string_view word = next_word(rest); !word.empty(); word = next_word(rest)) {
    double value = 0;
    const char* const end = word.data() + word.size();
    const auto [last, error] = std::from_chars(word.data(), end, value);
    if (last != end || (error != std::errc() && error != std::errc::result_out_of_range))
      file_.fail(start, "a line of the PLY must contain numbers only; export it again");
    if (error == std::errc::result_out_of_range) value = std::numeric_limits<double>::quiet_NaN();
    line_.push_back(value);
  }
  if (row_ > 0 && line_.size() < words_)
    file_.fail(start, fmt::format("row {} of the element {} must have {} numbers, not {}; export the PLY again", row_,
                                  name_, words_, line_.size()));
}

}  // namespace esim::inline scene
