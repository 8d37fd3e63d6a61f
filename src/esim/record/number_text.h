#pragma once

#include <cstdint>
#include <string>

#include "esim/core/time.h"

namespace esim {

/// 1234567 as "1,234,567".
std::string grouped(std::uint64_t number);

/// Room that put_seconds() needs at most.
inline constexpr int kMaxSecondsText = 24;

/// Writes a time as seconds with nine decimals (-1 ns: "-0.000000001"), exactly; returns the end of the text.
char* put_seconds(char* out, TimeNs t);

void append_seconds(std::string& text, TimeNs t);

}  // namespace esim
