#include "esim/video/stamps_file.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <functional>

#include "esim/core/error.h"
#include "esim/core/inputs/used_files.h"

namespace esim::inline video {
namespace {

constexpr double kMaxSeconds = 9e9;

using Words = std::vector<std::string>;

bool is_separator(char c) { return c == ' ' || c == '\t' || c == '\r' || c == ',' || c == ';'; }

/// Splits a line into `count` words; the last one extends to the end of the line, because names may contain spaces.
Words split(const std::string& line, std::size_t count) {
  Words words;
  std::size_t end = line.size();
  while (end > 0 && is_separator(line[end - 1])) --end;
  std::size_t at = 0;
  while (words.size() < count) {
    while (at < end && is_separator(line[at])) ++at;
    if (at == end) break;
    std::size_t stop = at;
    while (stop < end && (words.size() + 1 == count || !is_separator(line[stop]))) ++stop;
    words.push_back(line.substr(at, stop - at));
    at = stop;
  }
  return words;
}

template <typename Integer>
std::optional<Integer> parse_integer(const std::string& text) {
  Integer value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

/// Parses the lines that are not comments; the first one may be a heading that `parse` rejects.
using ParseLine = std::function<std::optional<StampedName>(const std::string& line)>;
std::vector<StampedName> read_lines(const std::filesystem::path& path, const ParseLine& parse, const char* expected) {
  std::ifstream file = open_input(path);
  if (!file) throw UserError(fmt::format("{}: cannot be read; check its permissions", path.string()));
  std::vector<StampedName> entries;
  int number = 0;
  bool may_be_heading = true;
  for (std::string line; std::getline(file, line);) {
    ++number;
    const Words words = split(line, 2);
    if (words.empty() || words[0][0] == '#') continue;
    const std::optional<StampedName> entry = parse(line);
    const bool heading = may_be_heading && !parse_seconds(words[0]);
    may_be_heading = false;
    if (!entry && heading) continue;
    if (!entry) throw UserError(fmt::format("{}, line {}: expected {}", path.string(), number, expected));
    entries.push_back(*entry);
  }
  return entries;
}

}  // namespace

std::optional<TimeNs> parse_seconds(const std::string& text) {
  double approximate = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), approximate);
  if (error != std::errc() || end != text.data() + text.size() || !(std::fabs(approximate) < kMaxSeconds)) {
    return std::nullopt;
  }
  if (text.find_first_of("eE") != std::string::npos) return to_ns(approximate);
  const std::size_t point = std::min(text.find('.'), text.size());
  const std::string whole = text.substr(text[0] == '-' ? 1 : 0, point - (text[0] == '-' ? 1 : 0));
  std::string decimals = point < text.size() ? text.substr(point + 1) : "";
  decimals.resize(9, '0');
  const TimeNs t =
      parse_integer<TimeNs>(whole).value_or(0) * kNsPerSecond + parse_integer<TimeNs>(decimals).value_or(0);
  return text[0] == '-' ? -t : t;
}

std::vector<StampedName> read_images_csv(const std::filesystem::path& path) {
  const auto parse = [](const std::string& line) -> std::optional<StampedName> {
    const Words words = split(line, 2);
    if (words.size() < 2) return std::nullopt;
    const std::optional<TimeNs> t = parse_integer<TimeNs>(words[0]);
    if (!t) return std::nullopt;
    return StampedName{*t, words[1]};
  };
  return read_lines(path, parse, "`time in ns, file`, for example 40000000, 000001.png");
}

std::vector<StampedName> read_timestamps_txt(const std::filesystem::path& path) {
  std::size_t columns = 0;  // of the first line; all lines must have the same number
  const auto parse = [&](const std::string& line) -> std::optional<StampedName> {
    Words words = split(line, 3);
    // `index seconds file`, or a name that contains a space?
    const bool indexed = words.size() == 3 && parse_integer<TimeNs>(words[0]) && parse_seconds(words[1]);
    if (indexed) words.erase(words.begin());
    if (words.size() == 3) words = split(line, 2);
    const std::size_t found = words.size() + (indexed ? 1 : 0);
    const std::optional<TimeNs> t = parse_seconds(words[0]);
    if (!t || (columns != 0 && columns != found)) return std::nullopt;
    columns = found;
    return StampedName{*t, words.size() == 2 ? words[1] : ""};
  };
  return read_lines(path, parse, "`seconds`, `seconds file` or `index seconds file`, the same on every line");
}

}  // namespace esim::inline video
