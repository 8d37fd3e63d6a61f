#include "esim/files/png_pixels.h"

#include <hwy/highway.h>
#include <isa-l/crc.h>
#include <isa-l/igzip_lib.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <limits>
#include <memory>
#include <string_view>

namespace esim::inline files {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

constexpr std::string_view kSignature = "\x89PNG\r\n\x1a\n";

std::uint32_t big_endian(const std::uint8_t* bytes) {
  return std::uint32_t{bytes[0]} << 24 | std::uint32_t{bytes[1]} << 16 | std::uint32_t{bytes[2]} << 8 | bytes[3];
}

struct Chunk {
  std::string_view name;
  std::span<const std::uint8_t> data;
};

/// Removes the next chunk from `rest`; false if it is cut off or its checksum is wrong.
bool take_chunk(std::span<const std::uint8_t>& rest, Chunk& chunk) {
  constexpr std::size_t kHead = 8, kChecksum = 4;
  if (rest.size() < kHead + kChecksum) return false;
  const std::size_t size = big_endian(rest.data());
  if (size > rest.size() - kHead - kChecksum) return false;
  chunk.name = {reinterpret_cast<const char*>(rest.data()) + 4, 4};
  chunk.data = rest.subspan(kHead, size);
  if (crc32_gzip_refl(0, rest.data() + 4, size + 4) != big_endian(rest.data() + kHead + size)) return false;
  rest = rest.subspan(kHead + size + kChecksum);
  return true;
}

/// Reads the size and the type of pixels from IHDR; false if the type is not supported.
bool read_header(const Chunk& chunk, ImagePixels& pixels) {
  if (chunk.name != "IHDR" || chunk.data.size() != 13) return false;
  const std::uint8_t* const head = chunk.data.data();
  const std::uint32_t width = big_endian(head), height = big_endian(head + 4);
  constexpr std::uint32_t kLargest = 1U << 20;
  if (width < 1 || height < 1 || width > kLargest || height > kLargest) return false;
  pixels.width = static_cast<int>(width), pixels.height = static_cast<int>(height);
  pixels.bits = head[8];
  constexpr int kChannels[] = {1, 0, 3, 0, 2, 0, 4};  // by colour type
  pixels.channels = head[9] < std::size(kChannels) ? kChannels[head[9]] : 0;
  pixels.row_bytes = width * static_cast<std::size_t>(pixels.channels * pixels.bits / 8);
  const bool known_methods = head[10] == 0 && head[11] == 0 && head[12] == 0;
  return (pixels.bits == 8 || pixels.bits == 16) && pixels.channels > 0 && known_methods;
}

/// The compressed bytes: those of the only IDAT chunk, or those of all, in `joined`. Empty if anything is invalid, or
/// if the image has a transparent colour.
std::span<const std::uint8_t> compressed_bytes(std::span<const std::uint8_t> rest, std::vector<std::uint8_t>& joined) {
  std::span<const std::uint8_t> all;
  Chunk chunk;
  while (take_chunk(rest, chunk)) {
    if (chunk.name == "IEND") return all;
    if (chunk.name == "tRNS") return {};
    if (chunk.name != "IDAT") continue;
    if (all.empty()) {
      all = chunk.data;
      continue;
    }
    if (joined.empty()) joined.assign(all.begin(), all.end());
    joined.insert(joined.end(), chunk.data.begin(), chunk.data.end());
    all = joined;
  }
  return {};
}

// A pixel's bytes as 16-bit numbers.
using Lanes = hn::FixedTag<std::int16_t, 8>;
using Pixel = hn::Vec<Lanes>;

template <std::size_t kBytes>
Pixel load(const std::uint8_t* from) {
  std::uint64_t word = 0;
  std::memcpy(&word, from, kBytes);
  const hn::FixedTag<std::uint64_t, 1> one;
  return hn::PromoteTo(Lanes(), hn::BitCast(hn::FixedTag<std::uint8_t, 8>(), hn::Set(one, word)));
}

/// The lowest eight bits of each number.
template <std::size_t kBytes>
Pixel store(Pixel numbers, std::uint8_t* to) {
  const Pixel bytes = hn::And(numbers, hn::Set(Lanes(), 0xFF));
  const auto packed = hn::DemoteTo(hn::FixedTag<std::uint8_t, 8>(), bytes);
  const std::uint64_t word = hn::GetLane(hn::BitCast(hn::FixedTag<std::uint64_t, 1>(), packed));
  std::memcpy(to, &word, kBytes);
  return bytes;
}

Pixel paeth(Pixel left, Pixel above, Pixel corner) {
  const Pixel to_left = hn::Abs(hn::Sub(above, corner)), to_above = hn::Abs(hn::Sub(left, corner));
  const Pixel to_corner = hn::Abs(hn::Sub(hn::Add(left, above), hn::Add(corner, corner)));
  const Pixel nearest = hn::Min(to_left, hn::Min(to_above, to_corner));
  return hn::IfThenElse(hn::Eq(nearest, to_left), left, hn::IfThenElse(hn::Eq(nearest, to_above), above, corner));
}

/// Each byte of a pixel is the sum of those to the left: a prefix sum of a vector, in logarithmically many steps.
template <std::size_t kBytes>
void undo_sub(const std::uint8_t* coded, std::uint8_t* out, std::size_t size) {
  const hn::FixedTag<std::uint8_t, 16> d;
  constexpr std::size_t kVector = 16, kWhole = kVector / kBytes * kBytes;  // bytes of whole pixels
  alignas(kVector) std::uint8_t last[kVector];
  for (std::size_t i = 0; i < kVector; ++i) last[i] = static_cast<std::uint8_t>(kWhole - kBytes + i % kBytes);
  const auto of_last = hn::Load(d, last);
  auto left = hn::Zero(d);
  std::size_t i = 0;
  for (; i + kVector <= size; i += kWhole) {
    auto sum = hn::LoadU(d, coded + i);
    sum = hn::Add(sum, hn::ShiftLeftBytes<kBytes>(sum));
    if constexpr (2 * kBytes < kVector) sum = hn::Add(sum, hn::ShiftLeftBytes<2 * kBytes>(sum));
    if constexpr (4 * kBytes < kVector) sum = hn::Add(sum, hn::ShiftLeftBytes<4 * kBytes>(sum));
    if constexpr (8 * kBytes < kVector) sum = hn::Add(sum, hn::ShiftLeftBytes<8 * kBytes>(sum));
    sum = hn::Add(sum, left);
    hn::StoreU(sum, d, out + i);
    left = hn::TableLookupBytes(sum, of_last);
  }
  for (; i < size; ++i) out[i] = static_cast<std::uint8_t>(coded[i] + (i < kBytes ? 0 : out[i - kBytes]));
}

enum Filter : std::uint8_t { kNone, kSub, kUp, kAverage, kPaeth, kFilters };

/// Undoes the filter of a row of pixels with kBytes bytes each; `above` is the previous decoded row, or zeros.
template <std::size_t kBytes>
void unfilter(std::uint8_t filter, const std::uint8_t* coded, const std::uint8_t* above, std::uint8_t* out,
              std::size_t size) {
  Pixel left = hn::Zero(Lanes()), corner = left;
  switch (filter) {
    case kSub:
      undo_sub<kBytes>(coded, out, size);
      break;
    case kUp:
      for (std::size_t i = 0; i < size; ++i) out[i] = static_cast<std::uint8_t>(coded[i] + above[i]);
      break;
    case kAverage:
      for (std::size_t i = 0; i < size; i += kBytes) {
        const Pixel mean = hn::ShiftRight<1>(hn::Add(left, load<kBytes>(above + i)));
        left = store<kBytes>(hn::Add(load<kBytes>(coded + i), mean), out + i);
      }
      break;
    case kPaeth:
      for (std::size_t i = 0; i < size; i += kBytes) {
        const Pixel up = load<kBytes>(above + i);
        left = store<kBytes>(hn::Add(load<kBytes>(coded + i), paeth(left, up, corner)), out + i);
        corner = up;
      }
      break;
    default:
      std::memcpy(out, coded, size);
  }
}

using Unfilter = void (*)(std::uint8_t, const std::uint8_t*, const std::uint8_t*, std::uint8_t*, std::size_t);

Unfilter unfilter_for(std::size_t pixel_bytes) {
  switch (pixel_bytes) {
    case 1:
      return unfilter<1>;
    case 2:
      return unfilter<2>;
    case 3:
      return unfilter<3>;
    case 4:
      return unfilter<4>;
    case 6:
      return unfilter<6>;
    default:
      return unfilter<8>;
  }
}

void swap_bytes(std::vector<std::uint8_t>& bytes) {
  for (std::size_t i = 0; i + 1 < bytes.size(); i += 2) std::swap(bytes[i], bytes[i + 1]);
}

/// False if the stream is damaged or does not fill `out` exactly.
bool inflate(std::span<const std::uint8_t> compressed, std::span<std::uint8_t> out) {
  constexpr std::size_t kMax = std::numeric_limits<std::uint32_t>::max();
  if (compressed.size() > kMax || out.size() > kMax) return false;
  thread_local const auto kState = std::make_unique<inflate_state>();
  isal_inflate_init(kState.get());
  kState->crc_flag = ISAL_ZLIB;  // with its header and its checksum
  kState->next_in = const_cast<std::uint8_t*>(compressed.data());
  kState->avail_in = static_cast<std::uint32_t>(compressed.size());
  kState->next_out = out.data();
  kState->avail_out = static_cast<std::uint32_t>(out.size());
  return isal_inflate(kState.get()) == ISAL_DECOMP_OK && kState->block_state == ISAL_BLOCK_FINISH &&
         kState->avail_out == 0;
}

}  // namespace

bool decode_png_pixels(std::span<const std::byte> file, ImagePixels& pixels) {
  std::span<const std::uint8_t> rest(reinterpret_cast<const std::uint8_t*>(file.data()), file.size());
  if (rest.size() < kSignature.size() ||
      !std::equal(kSignature.begin(), kSignature.end(), file.begin(),
                  [](char c, std::byte b) { return static_cast<std::byte>(c) == b; }))
    return false;
  rest = rest.subspan(kSignature.size());
  Chunk header;
  if (!take_chunk(rest, header) || !read_header(header, pixels)) return false;
  std::vector<std::uint8_t> joined;
  const std::span<const std::uint8_t> compressed = compressed_bytes(rest, joined);

  // Each row follows the number of its filter.
  constexpr std::size_t kMaxPerByte = 1040;  // deflate's limit, with a margin
  const std::size_t stride = pixels.row_bytes + 1, height = static_cast<std::size_t>(pixels.height);
  if (stride > kMaxPerByte * compressed.size() / height) return false;
  thread_local std::vector<std::uint8_t> filtered;
  filtered.resize(stride * height);
  if (!inflate(compressed, filtered)) return false;

  pixels.bytes.resize(pixels.row_bytes * height);
  const Unfilter undo = unfilter_for(static_cast<std::size_t>(pixels.channels * pixels.bits / 8));
  const std::vector<std::uint8_t> nothing(pixels.row_bytes);
  const std::uint8_t* above = nothing.data();
  for (std::size_t y = 0; y < height; ++y) {
    const std::uint8_t* const coded = filtered.data() + y * stride;
    std::uint8_t* const out = pixels.bytes.data() + y * pixels.row_bytes;
    if (*coded >= kFilters) return false;
    undo(*coded, coded + 1, above, out, pixels.row_bytes);
    above = out;
  }
  if (pixels.bits == 16 && std::endian::native == std::endian::little) swap_bytes(pixels.bytes);
  return true;
}

}  // namespace esim::inline files
