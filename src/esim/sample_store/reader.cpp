#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "esim/core/error.h"
#include "esim/core/load_unaligned.h"
#include "esim/files/codecs/zstandard.h"
#include "esim/files/input_file.h"
#include "esim/sample_store/layout.h"
#include "esim/sample_store/read_ahead.h"

namespace esim::inline sample_store {
namespace {

constexpr int kMaxExtent = 16384;  // px, as in scenarios
constexpr std::size_t kBlocksAhead = 3;

/// What files end within.
constexpr const char* kSamples =
    "the samples: their recording was interrupted, or the file was truncated; simulate again";

/// Irradiance of consecutive pixels after their differences, of which `Planes` bytes are not 0, and, unless `from` is
/// null, before them.
template <std::size_t Planes>
void undo_row(std::size_t count, const std::array<const std::uint8_t*, kPlanes>& bytes, int dropped_bits,
              std::uint32_t* __restrict codes, float* __restrict from, float* __restrict to) {
  const std::uint8_t *const a = bytes[0], *const b = bytes[1], *const c = bytes[2], *const d = bytes[3];
  for (std::size_t i = 0; i < count; ++i) {
    std::uint32_t difference = a[i] | static_cast<std::uint32_t>(b[i]) << 8;
    if constexpr (Planes > 2) difference |= static_cast<std::uint32_t>(c[i]) << 16;
    if constexpr (Planes > 3) difference |= static_cast<std::uint32_t>(d[i]) << 24;
    const std::uint32_t before = codes[i], now = undo_difference(difference, before);
    codes[i] = now;
    if (from != nullptr) from[i] = irradiance_of(before, dropped_bits);
    to[i] = irradiance_of(now, dropped_bits);
  }
}

std::string_view text_of(std::span<const std::byte> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

}  // namespace

struct SampleStoreReader::Impl {
  static constexpr std::size_t kNone = std::numeric_limits<std::size_t>::max();

  /// A block of segments.
  struct Block {
    std::vector<PortionEntry> portions;
    std::vector<SegmentEntry> entries;
    std::array<std::vector<std::uint8_t>, kPlanes> planes;
    std::size_t used_planes = kPlanes;  // the others are 0
    std::vector<float> irradiance;      // of all segments; with that of their start
    std::vector<float> start;           // of those that start where their pixels were before the block
    std::vector<std::size_t> first;     // of each segment's pixels in `irradiance`
    std::vector<std::size_t> previous;  // the previous segment of the tile in this block, or kNone
    std::vector<Segment> segments;
  };

  Impl(const std::filesystem::path& path, bool reads_ahead) : file(path), read_ahead(reads_ahead) {
    const auto wrong = [&](const std::string& reason) { file.fail(0, reason); };
    const std::span<const std::byte> bytes = file.read(sizeof(Header));
    if (bytes.size() < sizeof(Header) || std::memcmp(bytes.data(), kMagic.data(), kMagic.size()) != 0)
      wrong("it is not a store of samples (samples.esim of a recording)");
    const auto header = load_unaligned<Header>(bytes.data());
    if (header.version != kVersion) {
      wrong("its version is " + std::to_string(header.version) + ", but this esim reads version " +
            std::to_string(kVersion) + "; simulate again, or use the esim that wrote it");
    }
    if (header.width < 1 || header.width > kMaxExtent || header.height < 1 || header.height > kMaxExtent)
      wrong("its size, " + std::to_string(header.width) + " x " + std::to_string(header.height) + " px, is invalid");
    if (header.precision > 1 || header.end < header.start) wrong("its header is damaged");
    info = {header.width, header.height, header.start, header.end, static_cast<SamplePrecision>(header.precision)};
    last = Image<std::uint32_t>(info.width, info.height);
    covered = Image<std::uint8_t>(info.width, info.height);
  }

  void seek(TimeNs t);
  bool next_block(const Workers& workers);
  bool read(Block& block, const Workers& workers);
  void read_lists(const BlockHeader& header, std::span<const std::byte> compressed, Block& block);
  void check_segment(std::size_t segment, Block& block);
  void undo_differences(Rows rows, Block& block);
  [[noreturn]] void damaged(const std::string& what) const { file.fail(block_offset, "the block is damaged: " + what); }

  InputFile file;
  bool read_ahead;
  SampleStoreInfo info;
  Image<std::uint32_t> last;
  std::uint64_t block_offset = 0;
  TimeNs watermark = std::numeric_limits<TimeNs>::min();  // of the last portion
  struct LastSegment {
    TimeNs end = 0;
    std::uint64_t block_offset = 0;
    std::size_t index = 0;  // in the block
  };
  std::map<std::array<std::uint16_t, 4>, LastSegment> last_segments;  // of each tile
  Image<std::uint8_t> covered;                                        // by these tiles
  bool ended = false;
  bool must_be_key = false;  // the next block

  Block current;  // handed out
  std::size_t next_portion = 0, next_segment = 0;
  Portion portion;
  Workers one_thread{1};
  std::optional<ReadAhead<Block>> blocks_ahead;  // destroyed first: it uses the others
};

/// Tiles divide the image, and the segments of each follow each other.
void SampleStoreReader::Impl::check_segment(std::size_t segment, Block& block) {
  const SegmentEntry& entry = block.entries[segment];
  const bool inside = entry.width >= 1 && entry.height >= 1 && entry.x + entry.width <= info.width &&
                      entry.y + entry.height <= info.height;
  if (!inside || entry.own_start > 1) damaged("a tile is outside the image");
  if (entry.t1 < entry.t0 || entry.t0 < info.start || entry.t1 > info.end) damaged("a time is outside the simulation");
  const auto [found, is_new] =
      last_segments.try_emplace({entry.x, entry.y, entry.width, entry.height}, LastSegment{entry.t0, 0, 0});
  for (int y = entry.y; is_new && y < entry.y + entry.height; ++y) {
    for (int x = entry.x; x < entry.x + entry.width; ++x) {
      if (std::exchange(covered(x, y), std::uint8_t{1}) != 0) damaged("tiles overlap");
    }
  }
  const LastSegment before = std::exchange(found->second, {entry.t1, block_offset, segment});
  if (entry.t0 != before.end) damaged("a segment does not begin where the previous one of its tile ended");
  block.previous[segment] = before.block_offset == block_offset ? before.index : kNone;
}

void SampleStoreReader::Impl::read_lists(const BlockHeader& header, std::span<const std::byte> compressed,
                                         Block& block) {
  auto& portions = block.portions;
  auto& entries = block.entries;
  portions.resize(header.portions);
  entries.resize(header.segments);
  const std::size_t of_portions = portions.size() * sizeof(PortionEntry),
                    of_segments = entries.size() * sizeof(SegmentEntry);
  std::string lists(of_portions + of_segments, '\0');
  if (!decompress_zstandard(text_of(compressed), lists)) damaged("the list of its segments has another size");
  std::memcpy(portions.data(), lists.data(), of_portions);
  if (of_segments > 0) std::memcpy(entries.data(), lists.data() + of_portions, of_segments);
  std::uint64_t counted = 0, pixels = 0;
  for (const PortionEntry& entry : portions) {
    if (entry.segments > entries.size() || entry.watermark < watermark || entry.watermark > info.end)
      damaged("a portion is invalid");
    watermark = entry.watermark;
    counted += entry.segments;
  }
  block.previous.resize(entries.size());
  for (std::size_t i = 0; i < entries.size(); ++i) {
    check_segment(i, block);
    pixels += (1 + entries[i].own_start) * entries[i].width * std::uint64_t{entries[i].height};
  }
  if (counted != entries.size() || pixels != header.pixels) damaged("it has another number of segments or pixels");
}

/// The irradiance of some rows of all segments, from the differences, in order.
void SampleStoreReader::Impl::undo_differences(Rows rows, Block& block) {
  const int dropped = info.precision == SamplePrecision::rounded ? kDroppedBits : 0;
  for (std::size_t segment = 0; segment < block.entries.size(); ++segment) {
    const SegmentEntry& entry = block.entries[segment];
    const int first_row = std::max<int>(rows.first, entry.y), last_row = std::min(rows.last, entry.y + entry.height);
    const std::size_t width = entry.width, area = width * entry.height;
    const bool needs_start = block.previous[segment] == kNone;
    for (std::uint64_t part = 0; part <= entry.own_start; ++part) {
      for (int y = first_row; y < last_row; ++y) {
        const std::size_t i = block.first[segment] + part * area + static_cast<std::size_t>(y - entry.y) * width;
        const std::array<const std::uint8_t*, kPlanes> bytes{block.planes[0].data() + i, block.planes[1].data() + i,
                                                             block.planes[2].data() + i, block.planes[3].data() + i};
        const auto undo = block.used_planes <= 2 ? undo_row<2> : block.used_planes == 3 ? undo_row<3> : undo_row<4>;
        undo(width, bytes, dropped, last.row(y) + entry.x, needs_start ? block.start.data() + i : nullptr,
             block.irradiance.data() + i);
      }
    }
  }
}

/// Reads the next block; false at the end.
bool SampleStoreReader::Impl::read(Block& block, const Workers& workers) {
  block_offset = file.offset();
  const auto header = load_unaligned<BlockHeader>(file.read_exactly(sizeof(BlockHeader), kSamples).data());
  if (header.portions == 0) {
    if (file.offset() + header.list_bytes + sizeof(block_offset) != file.size()) damaged("more follows the end");
    return false;
  }
  if (std::exchange(must_be_key, false) && header.is_key == 0) damaged("it should be a key block");
  if (header.is_key != 0) last.fill(0);
  const std::uint64_t max_pixels = max_block_pixels(info.width, info.height);
  if (header.portions > kMaxBlockEntries || header.segments > kMaxBlockEntries || header.pixels > max_pixels)
    damaged("its header is invalid");
  std::uint64_t bytes = header.list_bytes;
  for (const std::uint32_t plane : header.plane_bytes) bytes += plane;
  const std::span<const std::byte> all = file.read_exactly(bytes, "a block: the file was truncated");
  std::array<std::span<const std::byte>, kPlanes> compressed;
  std::size_t offset = 0;
  for (std::size_t k = 0; k < kPlanes; ++k) {
    compressed[k] = all.subspan(offset, header.plane_bytes[k]);
    offset += header.plane_bytes[k];
  }
  read_lists(header, all.subspan(offset), block);
  block.used_planes = kPlanes;
  while (block.used_planes > 2 && header.plane_bytes[block.used_planes - 1] == 0) --block.used_planes;
  std::array<bool, kPlanes> good{};
  workers.for_each(static_cast<int>(kPlanes), [&](int i) {
    const auto k = static_cast<std::size_t>(i);
    block.planes[k].resize(header.pixels);
    if (compressed[k].empty()) {
      if (k < block.used_planes) std::ranges::fill(block.planes[k], std::uint8_t{0});
      good[k] = true;
      return;
    }
    std::vector<std::uint8_t>& plane = block.planes[k];
    good[k] = decompress_zstandard(text_of(compressed[k]), {reinterpret_cast<char*>(plane.data()), plane.size()});
  });
  for (const bool each : good) {
    if (!each) damaged("its irradiance has another size");
  }
  block.irradiance.resize(header.pixels);
  block.start.resize(header.pixels);
  block.first.clear();
  block.segments.clear();
  std::size_t pixel = 0;
  for (std::size_t i = 0; i < block.entries.size(); ++i) {
    const SegmentEntry& entry = block.entries[i];
    const Tile tile{entry.x, entry.y, entry.width, entry.height};
    block.first.push_back(pixel);
    const float* from = block.start.data() + pixel;
    if (entry.own_start != 0) {
      from = block.irradiance.data() + pixel;
      pixel += tile.area();
    } else if (block.previous[i] != kNone) {
      from = block.segments[block.previous[i]].irradiance1.row(tile.y) + tile.x;
    }
    const float* const to = block.irradiance.data() + pixel;
    pixel += tile.area();
    block.segments.push_back({tile, entry.t0, entry.t1, {entry.t0 == entry.t1 ? to : from, tile}, {to, tile}});
  }
  const int pieces = std::min(workers.threads(), info.height);
  workers.for_each(pieces, [&](int i) {
    undo_differences({info.height * i / pieces, info.height * (i + 1) / pieces}, block);
  });
  return true;
}

void SampleStoreReader::Impl::seek(TimeNs t) {
  constexpr std::size_t kOffsetBytes = sizeof(std::uint64_t);
  file.seek(file.size() - std::min<std::uint64_t>(file.size(), kOffsetBytes));
  block_offset = load_unaligned<std::uint64_t>(file.read_exactly(kOffsetBytes, kSamples).data());
  if (block_offset > file.size() - kOffsetBytes)
    file.fail(file.size(), fmt::format("the file ends within {}", kSamples));
  file.seek(block_offset);
  const auto end = load_unaligned<BlockHeader>(file.read_exactly(sizeof(BlockHeader), kSamples).data());
  if (end.portions != 0 || end.segments > kMaxBlockEntries)
    file.fail(file.size(), fmt::format("the file ends within {}", kSamples));
  std::vector<KeyEntry> keys(end.segments);
  const std::span<char> list{reinterpret_cast<char*>(keys.data()), keys.size() * sizeof(KeyEntry)};
  if (!decompress_zstandard(text_of(file.read_exactly(end.list_bytes, kSamples)), list))
    damaged("the list of key blocks has another size");
  const auto later = std::ranges::find_if(keys, [&](const KeyEntry& key) { return key.watermark > t; });
  if (later == keys.begin()) return file.seek(sizeof(Header));
  const KeyEntry& key = *std::prev(later);
  file.seek(key.offset);
  watermark = key.watermark;
  must_be_key = true;
}

/// Makes the next block the current one; false at the end.
bool SampleStoreReader::Impl::next_block(const Workers& workers) {
  const auto read_alone = [this](Block& block) { return read(block, one_thread); };
  if (read_ahead && !blocks_ahead) blocks_ahead.emplace(read_alone, kBlocksAhead);
  if (!(blocks_ahead ? blocks_ahead->next(current) : read(current, workers))) return false;
  next_portion = next_segment = 0;
  return true;
}

SampleStoreReader::SampleStoreReader(const std::filesystem::path& file, bool read_ahead)
    : impl_(std::make_unique<Impl>(file, read_ahead)) {}
SampleStoreReader::~SampleStoreReader() = default;
SampleStoreReader::SampleStoreReader(SampleStoreReader&&) noexcept = default;
SampleStoreReader& SampleStoreReader::operator=(SampleStoreReader&&) noexcept = default;

const SampleStoreInfo& SampleStoreReader::info() const { return impl_->info; }

void SampleStoreReader::seek(TimeNs t) { impl_->seek(t); }

bool SampleStoreReader::has_more() const { return impl_->next_portion < impl_->current.portions.size(); }

const SampleStoreReader::Portion* SampleStoreReader::next(const Workers& workers) {
  Impl& impl = *impl_;
  if (impl.ended) return nullptr;
  if (impl.next_portion == impl.current.portions.size() && !impl.next_block(workers)) {
    impl.ended = true;
    return nullptr;
  }
  const PortionEntry& entry = impl.current.portions[impl.next_portion++];
  impl.portion = {std::span(impl.current.segments).subspan(impl.next_segment, entry.segments), entry.watermark};
  impl.next_segment += entry.segments;
  return &impl.portion;
}

}  // namespace esim::inline sample_store
