#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace esim::inline formats::zip {

// The layout of zip files: PKWARE's APPNOTE, sections 4.3.7 (local header), 4.3.12 (central directory), 4.3.14 to
// 4.3.16 (its end), 4.5.3 (sizes of 64 bits). All numbers are little-endian.

inline constexpr std::uint32_t kLocalHeader = 0x04034b50, kDirectoryEntry = 0x02014b50, kEnd = 0x06054b50,
                               kEnd64 = 0x06064b50, kEnd64Locator = 0x07064b50;
inline constexpr std::size_t kLocalHeaderBytes = 30, kDirectoryEntryBytes = 46, kEndBytes = 22, kEnd64Bytes = 56,
                             kEnd64LocatorBytes = 20;
inline constexpr std::uint16_t kExtra64 = 1;           // tag of the extra field with sizes of 64 bits
inline constexpr std::uint32_t kIn64 = 0xffffffff;     // placeholder for a number in the extra field
inline constexpr std::uint16_t kManyEntries = 0xffff;  // the same for the number of entries
inline constexpr std::uint16_t kStored = 0, kDeflated = 8;

template <typename Integer>
void put(std::string& bytes, Integer value) {
  for (std::size_t i = 0; i < sizeof(Integer); ++i) bytes.push_back(static_cast<char>((value >> (8 * i)) & 0xff));
}

/// Reads a number from a position inside the bytes.
template <typename Integer>
Integer get(std::string_view bytes, std::size_t at) {
  Integer value = 0;
  for (std::size_t i = 0; i < sizeof(Integer); ++i) {
    value = static_cast<Integer>(value | static_cast<Integer>(static_cast<std::uint8_t>(bytes[at + i])) << (8 * i));
  }
  return value;
}

}  // namespace esim::inline formats::zip
