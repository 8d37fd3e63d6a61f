#include "esim/record/number_text.h"

#include <charconv>

namespace esim {

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

}  // namespace esim
