#pragma once

#include <aedat4_generated.h>

#include <cstddef>
#include <cstdint>
#include <span>

// Private to record/formats/aedat4: includes flatbuffers.

namespace esim::aedat4 {

inline constexpr char kVersionLine[] = "#!AER-DAT4.0\r\n";

/// Of the IMU: the value of g that dv-processing takes, so that m/s^2 read there are those that were written.
inline constexpr double kStandardGravity = 9.81007;  // m/s^2
inline constexpr double kDegreesPerRadian = 57.29577951308232;

/// Depths of pixels in Frame::format.
enum class Depth { bits8 = 0, bits16 = 2 };

/// The root of a buffer that has its size in front; null where it is not one of that kind, or damaged.
template <typename Table>
const Table* verified(std::span<const std::byte> bytes, const char* identifier) {
  const auto* const data = reinterpret_cast<const std::uint8_t*>(bytes.data());
  // The smallest table takes eight bytes.
  const auto most_tables = static_cast<flatbuffers::uoffset_t>(bytes.size() / 8 + 1);
  flatbuffers::Verifier verifier(data, bytes.size(), 64, most_tables);
  // The prefix, the root's offset and the identifier are looked at before the verifier does.
  if (bytes.size() < 3 * sizeof(flatbuffers::uoffset_t)) return nullptr;
  if (!verifier.VerifySizePrefixedBuffer<Table>(identifier)) return nullptr;
  return flatbuffers::GetSizePrefixedRoot<Table>(data);
}

}  // namespace esim::aedat4
