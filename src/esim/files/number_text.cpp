#include "esim/files/number_text.h"

#include <algorithm>
#include <charconv>
#include <limits>

namespace esim::inline files {
namespace {

bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\r'; }
bool is_digit(char c) { return c >= '0' && c <= '9'; }

}  // namespace

std::string grouped(std::uint64_t number) {
  std::string reversed;
  for (int digits = 0; digits == 0 || number > 0; ++digits, number /= 10) {
    if (digits > 0 && digits % 3 == 0) reversed.push_back(',');
    reversed.push_back(static_cast<char>('0' + number % 10));
  }
  return {reversed.rbegin(), reversed.rend()};
}

char* put_seconds(char* out, TimeNs t) {
  if (t < 0) *out++ = '-';
  const std::uint64_t magnitude = t < 0 ? 0 - static_cast<std::uint64_t>(t) : static_cast<std::uint64_t>(t);
  out = std::to_chars(out, out + kMaxSecondsText, magnitude / kNsPerSecond).ptr;
  auto fraction = static_cast<std::uint32_t>(magnitude % kNsPerSecond);
  *out = '.';
  for (int digit = 9; digit >= 1; --digit) {
    out[digit] = static_cast<char>('0' + fraction % 10);
    fraction /= 10;
  }
  return out + 10;
}

void append_seconds(std::string& text, TimeNs t) {
  char digits[kMaxSecondsText];
  text.append(digits, put_seconds(digits, t));
}

bool parse_seconds(std::string_view word, TimeNs& t) {
  const bool negative = !word.empty() && word[0] == '-';
  if (negative) word.remove_prefix(1);
  const std::size_t point = std::min(word.find('.'), word.size());
  std::int64_t seconds = 0;
  if (point == 0 || !is_digit(word[0]) || !parse_number(word.substr(0, point), seconds)) return false;
  const std::string_view decimals = word.substr(std::min(point + 1, word.size()));
  if (!std::all_of(decimals.begin(), decimals.end(), is_digit)) return false;
  std::int64_t ns = 0;
  for (std::size_t i = 0; i < 9; ++i) ns = 10 * ns + (i < decimals.size() ? decimals[i] - '0' : 0);
  if (seconds > std::numeric_limits<TimeNs>::max() / kNsPerSecond - 1) return false;
  t = seconds * kNsPerSecond + ns;
  if (negative) t = -t;
  return true;
}

std::string list_of_some(const std::vector<std::string>& items) {
  constexpr std::size_t kListed = 8;
  std::string text;
  for (std::size_t i = 0; i < std::min(items.size(), kListed); ++i) text += (i == 0 ? "" : ", ") + items[i];
  if (items.size() > kListed) text += " and " + std::to_string(items.size() - kListed) + " more";
  return text;
}

std::string_view problem_of_time(std::optional<TimeNs> last, TimeNs t) {
  constexpr TimeNs kMaxTime = std::numeric_limits<TimeNs>::max() / 2;  // differences of times stay representable
  if (t > kMaxTime || t < -kMaxTime) return "the time is out of range";
  if (last && t < *last) return "the time is earlier than the one before it: sort by time";
  return "";
}

std::string_view take_word(std::string_view& line) {
  std::size_t begin = 0;
  while (begin < line.size() && is_blank(line[begin])) ++begin;
  std::size_t end = begin;
  while (end < line.size() && !is_blank(line[end])) ++end;
  const std::string_view word = line.substr(begin, end - begin);
  line.remove_prefix(end);
  return word;
}

}  // namespace esim::inline files
