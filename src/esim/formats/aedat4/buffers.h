#pragma once

#include <aedat4_generated.h>

#include <cstddef>
#include <cstdint>
#include <span>

// Private to formats/aedat4: includes aedat4_generated.h.
namespace esim::inline formats::aedat4 {

inline constexpr char kVersionLine[] = "#!AER-DAT4.0\r\n";

/// The value of g in dv-processing, so that it reads the same m/s^2 that were written.
inline constexpr double kStandardGravity = 9.81007;  // m/s^2
inline constexpr double kDegreesPerRadian = 57.29577951308232;

/// Pixel depths in Frame::format.
enum class Depth { bits8 = 0, bits16 = 2 };

/// The root of a size-prefixed buffer; null if the buffer is of another kind or damaged.
template <typename Table>
const Table* verified(std::span<const std::byte> bytes, const char* identifier) {
  const auto* const data = reinterpret_cast<const std::uint8_t*>(bytes.data());
  // The smallest table has eight bytes.
  const auto max_tables = static_cast<flatbuffers::uoffset_t>(bytes.size() / 8 + 1);
  flatbuffers::Verifier verifier(data, bytes.size(), 64, max_tables);
  // The verifier does not check the prefix, the root's offset and the identifier before it reads them.
  if (bytes.size() < 3 * sizeof(flatbuffers::uoffset_t)) return nullptr;
  if (!verifier.VerifySizePrefixedBuffer<Table>(identifier)) return nullptr;
  return flatbuffers::GetSizePrefixedRoot<Table>(data);
}

}  // namespace esim::inline formats::aedat4
