// .splat files (antimatter15/splat): 32 bytes per splat, without a header.
#include <fmt/format.h>

#include <cstring>

#include "esim/core/inputs/used_files.h"
#include "esim/files/input_file.h"
#include "esim/scene/splats/splat_list.h"
#include "esim/scene/splats/splat_readers.h"

namespace esim::inline scene {
namespace {

constexpr std::size_t kSplatBytes = 32;

Splat unpack(const std::byte* from) {
  struct {
    float position[3], deviation[3];      // m
    std::uint8_t colour[4], rotation[4];  // R G B and opacity, from 0 to 255; w x y z, 128 + 128 times the component
  } bytes;
  static_assert(sizeof bytes == kSplatBytes);
  std::memcpy(&bytes, from, sizeof bytes);
  Splat splat;
  for (int i = 0; i < 3; ++i) {
    splat.position[i] = bytes.position[i];
    splat.deviation[i] = bytes.deviation[i];
    splat.harmonics[static_cast<std::size_t>(i)] = harmonic_of_colour(static_cast<float>(bytes.colour[i]) / 255);
    splat.rotation[i] = static_cast<float>(bytes.rotation[i + 1]) - 128;
  }
  splat.rotation[3] = static_cast<float>(bytes.rotation[0]) - 128;
  splat.opacity = static_cast<float>(bytes.colour[3]) / 255;
  return splat;
}

}  // namespace

Splats read_dot_splat(const std::filesystem::path& path, const WarningHandler& warn) {
  note_used(path);
  InputFile file(path);
  if (file.size() % kSplatBytes != 0)
    file.fail(file.size(), fmt::format("the file ends within a splat: a .splat file must have a multiple of {} bytes; "
                                       "copy or export it again",
                                       kSplatBytes));
  const std::uint64_t count = file.size() / kSplatBytes;
  SplatList list(path, 0, count, file.size());
  for (std::uint64_t i = 0; i < count; ++i) list.add(unpack(file.read_exactly(kSplatBytes, "a splat").data()));
  return list.finish(warn);
}

}  // namespace esim::inline scene
