// .spz files (nianticlabs/spz): numbers of few bits, compressed by gzip (versions 1 to 3) or Zstandard (version 4).
#include <fmt/format.h>
#include <zlib.h>

#include <bit>
#include <cmath>
#include <numbers>
#include <vector>

#include "esim/core/inputs/used_files.h"
#include "esim/core/load_unaligned.h"
#include "esim/files/codecs/zstandard.h"
#include "esim/files/input_file.h"
#include "esim/scene/splats/harmonics.h"
#include "esim/scene/splats/splat_list.h"
#include "esim/scene/splats/splat_readers.h"

namespace esim::inline scene {
namespace {

namespace fs = std::filesystem;

constexpr std::uint32_t kMagic = 0x5053474E;  // "NGSP"
constexpr std::size_t kGzipHeader = 16, kHeader = 32;
constexpr std::uint8_t kAntialiased = 1, kHasExtensions = 2;
constexpr std::uint32_t kCoordinateSystem = 0xADBE0003;  // type of the extension SPZ_ADOBE_coordinate_system
constexpr std::size_t kMaxExtensionBytes = 1 << 16;      // that are read
constexpr int kMaxFileDegree = 4;

using Bytes = std::span<const std::uint8_t>;

template <typename T>
T load(Bytes bytes, std::size_t at) {
  return load_unaligned<T>(bytes.subspan(at, sizeof(T)).data());
}

struct Header {
  std::uint32_t version = 0, count = 0;
  int degree = 0, fraction_bits = 0;
  std::uint8_t flags = 0;

  std::size_t rest() const { return static_cast<std::size_t>(degree * (degree + 2)) * 3; }  // coefficients per splat
};

/// The first 16 bytes, which all versions have in common.
Header read_header(const fs::path& file, Bytes bytes) {
  if (bytes.size() < kGzipHeader) fail_splats(file, "is cut off within its header; copy it again");
  if (load<std::uint32_t>(bytes, 0) != kMagic) fail_splats(file, "is not an .spz file: it must begin with 'NGSP'");
  Header header{load<std::uint32_t>(bytes, 4), load<std::uint32_t>(bytes, 8), bytes[12], bytes[13], bytes[14]};
  if (header.version < 1 || header.version > 4)
    fail_splats(file, fmt::format("version of .spz must be 1 to 4, not {}; save it in one of these", header.version));
  if (header.degree > kMaxFileDegree)
    fail_splats(file, fmt::format("is damaged: the degree of its harmonics must be 0 to 4, not {}", header.degree));
  if (header.fraction_bits > 24)
    fail_splats(
        file, fmt::format("is damaged: its positions must have 0 to 24 fractional bits, not {}", header.fraction_bits));
  return header;
}

/// What a file says of its splats, one after the other.
struct Streams {
  std::vector<std::uint8_t> positions, opacities, colours, deviations, rotations, harmonics, extensions;
};

/// Bytes per splat of the streams, in the order of the files.
std::array<std::pair<std::vector<std::uint8_t> Streams::*, std::size_t>, 6> stream_bytes(const Header& header) {
  return {{{&Streams::positions, header.version == 1 ? 6 : 9},
           {&Streams::opacities, 1},
           {&Streams::colours, 3},
           {&Streams::deviations, 3},
           {&Streams::rotations, header.version >= 3 ? 4 : 3},
           {&Streams::harmonics, header.rest()}}};
}

/// Decompresses gzip in pieces.
class Gunzip {
 public:
  explicit Gunzip(const fs::path& path) : file_(path) {
    if (inflateInit2(&stream_, 16 + MAX_WBITS) != Z_OK) throw std::bad_alloc();
  }
  ~Gunzip() { inflateEnd(&stream_); }
  Gunzip(const Gunzip&) = delete;
  Gunzip& operator=(const Gunzip&) = delete;

  /// Fills `out` and returns the number of bytes; fewer only at the end of the data.
  std::size_t read(std::span<std::uint8_t> out) {
    std::size_t done = 0;
    while (done < out.size() && !ended_) {
      if (stream_.avail_in == 0) next_input();
      constexpr std::size_t kMaxStep = 1 << 30;  // zlib counts in 32 bits
      const std::size_t step = std::min(out.size() - done, kMaxStep);
      stream_.next_out = out.data() + done;
      stream_.avail_out = static_cast<uInt>(step);
      const int code = inflate(&stream_, Z_NO_FLUSH);
      done += step - stream_.avail_out;
      ended_ = code == Z_STREAM_END;
      if (code != Z_OK && code != Z_STREAM_END && code != Z_BUF_ERROR)
        file_.fail(file_.offset(), "the data compressed by gzip are damaged; copy or export it again");
    }
    return done;
  }

  const InputFile& file() const { return file_; }

 private:
  void next_input() {
    const std::span<const std::byte> input = file_.read(1 << 16);
    if (input.empty()) file_.fail(file_.offset(), "the file ends within its compressed data; copy or export it again");
    stream_.next_in = const_cast<Bytef*>(reinterpret_cast<const Bytef*>(input.data()));
    stream_.avail_in = static_cast<uInt>(input.size());
  }

  InputFile file_;
  z_stream stream_{};
  bool ended_ = false;
};

Splats unpack(const fs::path& file, const Header& header, const Streams& streams, SplatList list,
              const WarningHandler& warn);

SplatList make_list(const fs::path& file, const Header& header, std::uint64_t file_bytes, const WarningHandler& warn) {
  if (header.degree > kMaxSplatDegree) warn_of_degree(file, header.degree, warn);
  SplatList list(file, std::min(header.degree, kMaxSplatDegree), header.count, file_bytes);
  if ((header.flags & kAntialiased) != 0) list.set_filter(SplatFilter::antialiased);
  return list;
}

Splats read_gzip(const fs::path& path, const WarningHandler& warn) {
  Gunzip data(path);
  std::array<std::uint8_t, kGzipHeader> start;
  const Header header = read_header(path, Bytes(start).first(data.read(start)));
  if (header.version > 3) fail_splats(path, "is damaged: version 4 of .spz is not compressed by gzip");
  SplatList list = make_list(path, header, data.file().size(), warn);
  Streams streams;
  for (const auto& [member, bytes] : stream_bytes(header)) {
    std::vector<std::uint8_t>& stream = streams.*member;
    stream.resize(bytes * header.count);
    if (data.read(stream) < stream.size())
      fail_splats(path, fmt::format("is cut off: it must have {} splats; copy or export it again", header.count));
  }
  // Also without extensions, so that the checksum at the end is tested.
  streams.extensions.resize(kMaxExtensionBytes);
  streams.extensions.resize(data.read(streams.extensions));
  if ((header.flags & kHasExtensions) == 0) streams.extensions.clear();
  return unpack(path, header, streams, std::move(list), warn);
}

Splats read_zstandard(const fs::path& path, const WarningHandler& warn) {
  InputFile file(path);
  const std::span<const std::byte> raw = file.read_exactly(file.size(), "the file");
  const Bytes bytes(reinterpret_cast<const std::uint8_t*>(raw.data()), raw.size());
  const Header header = read_header(path, bytes);
  if (header.version != 4) fail_splats(path, "is damaged: versions 1 to 3 of .spz must be compressed by gzip");
  if (bytes.size() < kHeader) fail_splats(path, "is cut off within its header; copy it again");
  const std::size_t stream_count = bytes[15], table = load<std::uint32_t>(bytes, 16), table_bytes = stream_count * 16;
  if (table < kHeader || table > bytes.size() || table_bytes > bytes.size() - table)
    file.fail(16, "the table of streams is beyond the end of the file; copy or export it again");

  SplatList list = make_list(path, header, bytes.size(), warn);
  Streams streams;
  if ((header.flags & kHasExtensions) != 0) {
    const Bytes extensions = bytes.subspan(kHeader, std::min(table - kHeader, kMaxExtensionBytes));
    streams.extensions.assign(extensions.begin(), extensions.end());
  }
  std::size_t at = table + table_bytes, index = 0;
  for (const auto& [member, bytes_per_splat] : stream_bytes(header)) {
    if (bytes_per_splat == 0) continue;  // no harmonics: this stream is empty or left out
    if (index >= stream_count)
      file.fail(15, fmt::format("the file must have more than {} streams; export it again", stream_count));
    const std::uint64_t packed = load<std::uint64_t>(bytes, table + index * 16);
    const std::uint64_t unpacked = load<std::uint64_t>(bytes, table + index * 16 + 8);
    const std::uint64_t expected = std::uint64_t{bytes_per_splat} * header.count;
    if (packed > bytes.size() - at)
      file.fail(at, fmt::format("the file ends within stream {}; copy or export it again", index));
    if (unpacked != expected)
      file.fail(table + index * 16 + 8,
                fmt::format("stream {} must have {} bytes, not {}; export it again", index, expected, unpacked));
    std::vector<std::uint8_t>& stream = streams.*member;
    stream.resize(expected);
    if (!decompress_zstandard({reinterpret_cast<const char*>(raw.data()) + at, static_cast<std::size_t>(packed)},
                              {reinterpret_cast<char*>(stream.data()), stream.size()}))
      file.fail(at, fmt::format("stream {}, compressed by Zstandard, is damaged; copy or export it again", index));
    at += packed, ++index;
  }
  return unpack(path, header, streams, std::move(list), warn);
}

/// The signs of the file's axes in right, down, forward. Without the extension, they are right, up, back.
Eigen::Vector3f axes(const fs::path& file, Bytes extensions) {
  // Records of a type and a number of bytes, in 32 bits each, and so many bytes.
  for (std::size_t at = 0; at + 8 <= extensions.size();) {
    const auto type = load<std::uint32_t>(extensions, at);
    const std::size_t bytes = load<std::uint32_t>(extensions, at + 4);
    at += 8;
    if (type == kCoordinateSystem && bytes >= 4 && at + 4 <= extensions.size()) {
      // 1 to 8: bit 0 is right, not left; bit 1 up, not down; bit 2 front, not back. Others permute the axes.
      const auto system = load<std::uint32_t>(extensions, at);
      if (system > 8) fail_splats(file, fmt::format("has axes of the kind {}; only 1 to 8 are supported", system));
      if (system > 0)
        return {((system - 1) & 1) != 0 ? 1.0F : -1.0F, ((system - 1) & 2) != 0 ? -1.0F : 1.0F,
                ((system - 1) & 4) != 0 ? 1.0F : -1.0F};
    }
    at += bytes;
  }
  return {1, -1, -1};
}

float half(std::uint16_t bits) {
  const int exponent = (bits >> 10) & 31;
  const auto mantissa = static_cast<float>(bits & 1023);
  const float size = exponent == 0    ? std::ldexp(mantissa, -24)
                     : exponent == 31 ? (mantissa == 0 ? INFINITY : NAN)
                                      : std::ldexp(mantissa + 1024, exponent - 25);
  return (bits & 0x8000) != 0 ? -size : size;
}

/// Signed fixed-point numbers of 24 bits, or in version 1, floating-point numbers of 16 bits.
Eigen::Vector3f position(Bytes streams, const Header& header, std::size_t splat) {
  Eigen::Vector3f result;
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t number = 3 * splat + i;
    float value = 0;
    if (header.version == 1) {
      value = half(load<std::uint16_t>(streams, 2 * number));
    } else {
      const std::uint8_t* const from = &streams[3 * number];
      const std::uint32_t bits =
          std::uint32_t{from[0]} << 8 | std::uint32_t{from[1]} << 16 | std::uint32_t{from[2]} << 24;
      value = std::ldexp(static_cast<float>(static_cast<std::int32_t>(bits) >> 8), -header.fraction_bits);
    }
    result[static_cast<Eigen::Index>(i)] = value;
  }
  return result;
}

/// x y z w. Before version 3, x y z in a byte each, and w is not negative. Since then, the index of the largest
/// component in 2 bits, and the others in 10 bits each: a sign, and 511 is sqrt(1/2).
Eigen::Vector4f rotation(Bytes stream, const Header& header, std::size_t splat) {
  Eigen::Vector4f q;
  float rest = 1;
  if (header.version < 3) {
    for (int i = 0; i < 3; ++i) {
      q[i] = static_cast<float>(stream[3 * splat + static_cast<std::size_t>(i)]) / 127.5F - 1;
      rest -= q[i] * q[i];
    }
    q[3] = std::sqrt(std::max(rest, 0.0F));
    return q;
  }
  auto bits = load<std::uint32_t>(stream, 4 * splat);
  const auto largest = static_cast<Eigen::Index>(bits >> 30);
  for (Eigen::Index i = 3; i >= 0; --i) {
    if (i == largest) continue;
    const float size = static_cast<float>(bits & 511) / 511 * std::numbers::sqrt2_v<float> / 2;
    q[i] = (bits & 512) != 0 ? -size : size;
    rest -= q[i] * q[i];
    bits >>= 10;
  }
  q[largest] = std::sqrt(std::max(rest, 0.0F));
  return q;
}

Splats unpack(const fs::path& file, const Header& header, const Streams& streams, SplatList list,
              const WarningHandler& warn) {
  constexpr float kColourScale = 0.15F;  // of the coefficient of degree 0
  const Eigen::Vector3f flip = axes(file, streams.extensions);
  const std::array<float, kMaxSplatCoefficients> signs = harmonic_signs(flip);
  const Eigen::Vector3f turn = flip * flip.prod();  // F R F has the vector part det(F) F v
  for (std::size_t i = 0; i < header.count; ++i) {
    Splat splat;
    splat.position = position(streams.positions, header, i).cwiseProduct(flip);
    splat.rotation = rotation(streams.rotations, header, i);
    splat.rotation.head<3>() = splat.rotation.head<3>().cwiseProduct(turn);
    splat.opacity = static_cast<float>(streams.opacities[i]) / 255;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      splat.deviation[static_cast<Eigen::Index>(axis)] =
          std::exp(static_cast<float>(streams.deviations[3 * i + axis]) / 16 - 10);
      splat.harmonics[axis] = (static_cast<float>(streams.colours[3 * i + axis]) / 255 - 0.5F) / kColourScale;
    }
    for (std::size_t k = 1; k < list.coefficients(); ++k) {
      const std::uint8_t* const from = &streams.harmonics[i * header.rest() + 3 * (k - 1)];
      for (std::size_t colour = 0; colour < 3; ++colour)
        splat.harmonics[3 * k + colour] = signs[k] * (static_cast<float>(from[colour]) - 128) / 128;
    }
    list.add(splat);
  }
  return list.finish(warn);
}

}  // namespace

bool is_gzip_spz(const fs::path& file) {
  std::array<std::uint8_t, 4> start;
  return Gunzip(file).read(start) == start.size() && load<std::uint32_t>(start, 0) == kMagic;
}

Splats read_spz(const fs::path& file, const WarningHandler& warn) {
  note_used(file);
  return read_head(file, 4) == "NGSP" ? read_zstandard(file, warn) : read_gzip(file, warn);
}

}  // namespace esim::inline scene
