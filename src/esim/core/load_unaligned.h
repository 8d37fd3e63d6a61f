#pragma once

#include <cstring>
#include <type_traits>

namespace esim::inline core {

/// The value that is stored at these bytes, in the byte order of the processor.
template <typename T>
T load_unaligned(const void* from) {
  static_assert(std::is_trivially_copyable_v<T>);
  T value;
  std::memcpy(&value, from, sizeof value);
  return value;
}

}  // namespace esim::inline core
