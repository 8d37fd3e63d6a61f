#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <span>

#include "esim/core/inputs/used_files.h"
#include "esim/core/load_unaligned.h"
#include "esim/files/input_file.h"
#include "esim/scene/vertices/frame_readers.h"
#include "esim/scene/vertices/mesh_formats.h"

namespace esim::inline scene {
namespace {

static_assert(std::endian::native == std::endian::little);

constexpr double kMaxTime_s = 1e6, kMinStep_s = 1e-6;

template <typename T>
T load(std::span<const std::byte> bytes, std::size_t at) {
  return load_unaligned<T>(bytes.data() + at);
}

template <typename T>
T load_big_endian(std::span<const std::byte> bytes, std::size_t at) {
  return std::bit_cast<T>(__builtin_bswap32(load<std::uint32_t>(bytes, at)));
}

/// A count, which must be at least 1.
std::size_t checked_count(const std::filesystem::path& file, std::int32_t count, const char* what) {
  if (count < 1)
    fail_vertices(
        file, fmt::format("its header says that it has {} {}; it must be at least 1, so export it again", count, what));
  return static_cast<std::size_t>(count);
}

/// Throws UserError unless the rest of the file is what its header says, so that a small file cannot request gigabytes.
void check_size(const InputFile& in, std::size_t frames, std::size_t vertices, std::size_t bytes_per_frame) {
  const std::uint64_t expected = in.offset() + std::uint64_t{frames} * bytes_per_frame;
  if (in.size() == expected) return;
  fail_vertices(in.path(), fmt::format("must have {} bytes for {} frames of {} vertices, but has {}; copy or export it "
                                       "again",
                                       expected, frames, vertices, in.size()));
}

/// Reads all positions.
std::vector<Eigen::Vector3f> positions_of(InputFile& in, std::size_t frames, std::size_t vertices, bool swapped) {
  std::vector<Eigen::Vector3f> positions(frames * vertices);
  for (std::size_t frame = 0; frame < frames; ++frame) {
    const std::span<Eigen::Vector3f> of_frame(positions.data() + frame * vertices, vertices);
    const std::span<std::byte> bytes = std::as_writable_bytes(of_frame);
    if (in.read_into(bytes) != bytes.size())
      fail_vertices(in.path(), "became shorter while it was read; read it again");
    for (std::size_t i = 0; i < vertices; ++i) {
      if (swapped) {
        for (float& number : of_frame[i].reshaped())
          number = std::bit_cast<float>(__builtin_bswap32(std::bit_cast<std::uint32_t>(number)));
      }
      check_vertex(in.path(), i, of_frame[i], fmt::format(" of frame {}", frame));
    }
  }
  return positions;
}

}  // namespace

VertexFrames read_pc2(const VertexFile& vertices, std::size_t expected) {
  constexpr std::size_t kHeader = 32, kSignature = 12;
  note_used(vertices.file);
  InputFile in(vertices.file);
  const std::span<const std::byte> header = in.read(kHeader);
  if (header.size() < kHeader || std::memcmp(header.data(), "POINTCACHE2", kSignature) != 0)
    fail_vertices(in.path(), "must begin with the 32 bytes of the header of a PC2 file; export it again");
  if (const auto version = load<std::int32_t>(header, 12); version != 1)
    fail_vertices(in.path(),
                  fmt::format("has version {} of PC2, but only version 1 is known; export it again", version));
  const auto frames_per_sample = load<float>(header, 24);
  const auto points = load<std::int32_t>(header, 16), samples = load<std::int32_t>(header, 28);
  const std::size_t count = checked_count(in.path(), points, "vertices");
  const std::size_t frames = checked_count(in.path(), samples, "samples");
  if (!(frames_per_sample > 0) || !std::isfinite(frames_per_sample))
    fail_vertices(in.path(), fmt::format("its header says that samples are {} frames apart; it must be more than 0, so "
                                         "export it again",
                                         frames_per_sample));
  check_counts(in.path(), frames, count, expected);
  check_size(in, frames, count, count * sizeof(Eigen::Vector3f));
  VertexFrames result{times_at_rate(vertices, frames, double{frames_per_sample}), {}};
  result.positions = positions_of(in, frames, count, false);
  return result;
}

VertexFrames read_mdd(const VertexFile& vertices, std::size_t expected) {
  if (vertices.rate_hz)
    fail_vertices(
        vertices.file,
        "MDD files have times in seconds, so that rate_hz must not be given; remove it, or change the speed by "
        "animation.time_scale");
  note_used(vertices.file);
  InputFile in(vertices.file);
  const std::span<const std::byte> header = in.read(2 * sizeof(std::int32_t));
  if (header.size() < 2 * sizeof(std::int32_t))
    fail_vertices(in.path(), "ends within the header of an MDD file; copy or export it again");
  const auto all = load_big_endian<std::int32_t>(header, 0), points = load_big_endian<std::int32_t>(header, 4);
  const std::size_t frames = checked_count(in.path(), all, "frames");
  const std::size_t count = checked_count(in.path(), points, "vertices");
  check_counts(in.path(), frames, count, expected);
  check_size(in, frames, count, sizeof(float) + count * sizeof(Eigen::Vector3f));
  VertexFrames result;
  const std::span<const std::byte> times = in.read_exactly(frames * sizeof(float), "the times of the frames");
  for (std::size_t i = 0; i < frames; ++i) {
    const double t_s = double{load_big_endian<float>(times, i * sizeof(float))};
    if (!(std::abs(t_s) <= kMaxTime_s))
      fail_vertices(in.path(), fmt::format("frame {} is at {} s; times must be finite, and at most {} s, so export it "
                                           "again",
                                           i, t_s, kMaxTime_s));
    if (i > 0 && !(t_s - result.times_s.back() >= kMinStep_s))
      fail_vertices(in.path(),
                    fmt::format("frame {} is at {} s, but frame {} at {} s; times must increase by at least a "
                                "microsecond, so export it again",
                                i, t_s, i - 1, result.times_s.back()));
    result.times_s.push_back(t_s);
  }
  result.positions = positions_of(in, frames, count, true);
  return result;
}

std::vector<double> times_at_rate(const VertexFile& vertices, std::size_t frames, double frames_per_sample) {
  if (!vertices.rate_hz)
    fail_vertices(vertices.file, "has frames without times; set rate_hz to the frames per second, such as 24");
  const double step_s = frames_per_sample / *vertices.rate_hz;
  if (!(*vertices.rate_hz > 0) || !(step_s >= kMinStep_s) || !(step_s * static_cast<double>(frames) <= kMaxTime_s))
    fail_vertices(vertices.file,
                  fmt::format("rate_hz must be positive, the steps at least a microsecond, and all of it at most {} s "
                              "long; but it is {}, for {} frames",
                              kMaxTime_s, *vertices.rate_hz, frames));
  std::vector<double> times_s;
  for (std::size_t i = 0; i < frames; ++i) times_s.push_back(static_cast<double>(i) * step_s);
  return times_s;
}

void check_counts(const std::filesystem::path& file, std::size_t frames, std::size_t vertices, std::size_t expected) {
  if (vertices != expected)
    fail_vertices(
        file, fmt::format("has {} vertices, but the mesh has {}; export both from the same mesh", vertices, expected));
  if (frames > kMaxVertexFrames || frames > kMaxFrameVertices / vertices)
    fail_vertices(file,
                  fmt::format("has {} frames of {} vertices, but at most {} frames, and {} vertices in all frames "
                              "together, are kept in memory; export fewer frames, or a simpler mesh",
                              frames, vertices, kMaxVertexFrames, kMaxFrameVertices));
}

}  // namespace esim::inline scene
