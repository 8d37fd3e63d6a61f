#pragma once

#include <algorithm>
#include <string_view>

// Private to motion.
namespace esim::inline motion {

/// Whether `a` comes before `b` if the numbers in them are compared as numbers: img9 before img10. Names that differ
/// only in leading zeros are compared as text.
inline bool natural_less(std::string_view a, std::string_view b) {
  const std::string_view complete_a = a, complete_b = b;
  const auto is_digit = [](char c) { return c >= '0' && c <= '9'; };
  const auto take_number = [&](std::string_view& text) {
    const auto end = std::find_if_not(text.begin(), text.end(), is_digit);
    std::string_view digits = text.substr(0, static_cast<std::size_t>(end - text.begin()));
    text.remove_prefix(digits.size());
    digits.remove_prefix(std::min(digits.find_first_not_of('0'), digits.size()));
    return digits;
  };
  while (!a.empty() && !b.empty()) {
    if (is_digit(a.front()) && is_digit(b.front())) {
      const std::string_view x = take_number(a), y = take_number(b);
      if (x.size() != y.size()) return x.size() < y.size();
      if (x != y) return x < y;
    } else {
      const auto x = static_cast<unsigned char>(a.front()), y = static_cast<unsigned char>(b.front());
      if (x != y) return x < y;
      a.remove_prefix(1), b.remove_prefix(1);
    }
  }
  if (a.empty() != b.empty()) return a.empty();
  return complete_a < complete_b;
}

}  // namespace esim::inline motion
