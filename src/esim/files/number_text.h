#pragma once

#include <charconv>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

#include "esim/core/time.h"

namespace esim::inline files {

/// 1234567 as "1,234,567".
std::string grouped(std::uint64_t number);

/// Maximum length of the text of put_seconds().
inline constexpr int kMaxSecondsText = 24;

/// Writes a time as seconds with nine decimals (-1 ns: "-0.000000001"), exactly; returns the end of the text.
char* put_seconds(char* out, TimeNs t);

void append_seconds(std::string& text, TimeNs t);

/// Reads such a time, with any number of decimals, exactly; digits beyond the nanosecond are dropped. Returns false for
/// anything else, including exponents.
bool parse_seconds(std::string_view word, TimeNs& t);

/// Reads a number that makes up a whole word; returns false for anything else or if it is out of range.
template <typename Number>
bool parse_number(std::string_view word, Number& value) {
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  return error == std::errc() && end == word.data() + word.size();
}

/// The first few items, separated by commas, and the number of the others: "a, b and 7 more".
std::string list_of_some(const std::vector<std::string>& items);

/// The problem of a time that follows another one in a recording; "" if it is valid.
std::string_view problem_of_time(std::optional<TimeNs> last, TimeNs t);

/// Takes the next word, up to a blank, off the start of a line; empty at its end.
std::string_view take_word(std::string_view& line);

}  // namespace esim::inline files
