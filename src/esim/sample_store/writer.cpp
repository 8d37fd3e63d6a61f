#include <algorithm>
#include <memory>
#include <string>
#include <utility>

#include "esim/core/error.h"
#include "esim/core/state_archive.h"
#include "esim/files/codecs/zstandard.h"
#include "esim/files/output_file.h"
#include "esim/sample_store/layout.h"

namespace esim::inline sample_store {
namespace {

// Levels of Zstandard. The lowest bytes are almost random: to compress them by some percent would triple the time.
constexpr int kLevel = 1, kLevelOfLowest = -1;

template <typename T>
std::string_view bytes_of(const T& value) {
  return {reinterpret_cast<const char*>(&value), sizeof value};
}

template <typename T>
std::string_view bytes_of(const std::vector<T>& values) {
  return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)};
}

}  // namespace

struct SampleStoreWriter::Impl {
  Impl(const std::filesystem::path& path, const SampleStoreInfo& store)
      : file(std::make_unique<OutputFile>(path)), info(store), last(store.width, store.height) {
    Header header;
    header.precision = static_cast<std::uint32_t>(info.precision);
    header.width = info.width, header.height = info.height;
    header.start = info.start, header.end = info.end;
    file->append(bytes_of(header));
    file->flush();
  }

  Impl(const std::filesystem::path& path, const SampleStoreInfo& store, std::span<const std::byte> state)
      : info(store) {
    StateReader archive(state);
    std::uint64_t kept = 0;
    archive.value(kept);
    transfer(archive, *this);
    if (last.width() != info.width || last.height() != info.height)
      throw UserError(path.string() + ": the saved state has another size; simulate again");
    file = std::make_unique<OutputFile>(path, kept);
  }

  std::uint32_t code(float irradiance) const { return code_of(irradiance, info.precision == SamplePrecision::rounded); }

  /// A block ends after the segment with which it is full.
  bool full() const {
    return planes[0].size() >= kUsualBlockPixels || std::max(segments.size(), portions.size()) + 2 >= kMaxBlockEntries;
  }

  void begin_block();
  void add(const Segment& segment);
  void add(const ImageView<float>& irradiance, const Tile& tile);
  void write_block(const Workers& workers);
  void write_end();

  /// The members that state() has.
  template <class Archive, class Self>
  static void transfer(Archive& archive, Self& self) {
    archive.value(self.watermark);
    archive.sized_image(self.last);
    archive.list(self.keys);
    archive.value(self.is_key);
    archive.list(self.portions);
    archive.list(self.segments);
    for (auto& plane : self.planes) archive.list(plane);
  }

  std::unique_ptr<OutputFile> file;
  SampleStoreInfo info;
  TimeNs watermark = info.start;  // of the last portion
  Image<std::uint32_t> last;      // code of each pixel's latest sample
  std::vector<KeyEntry> keys;

  // The block.
  bool is_key = false;
  std::vector<PortionEntry> portions;
  std::vector<SegmentEntry> segments;
  std::array<std::vector<std::uint8_t>, kPlanes> planes;
};

void SampleStoreWriter::Impl::begin_block() {
  is_key = keys.empty() || watermark - keys.back().watermark >= kKeyInterval;
  if (!is_key) return;
  keys.push_back({watermark, file->size()});
  last.fill(0);
}

/// Appends the irradiance of a tile.
void SampleStoreWriter::Impl::add(const ImageView<float>& irradiance, const Tile& tile) {
  const auto width = static_cast<std::size_t>(tile.width);
  std::array<std::uint8_t*, kPlanes> out{};
  for (std::size_t k = 0; k < kPlanes; ++k) {
    planes[k].resize(planes[k].size() + tile.area());
    out[k] = planes[k].data() + (planes[k].size() - tile.area());
  }
  for (int y = tile.y; y < tile.y + tile.height; ++y) {
    const float* const row = irradiance.row(y) + tile.x;
    std::uint32_t* const before = last.row(y) + tile.x;
    for (std::size_t i = 0; i < width; ++i) {
      const std::uint32_t now = code(row[i]), d = difference(now, before[i]);
      before[i] = now;
      for (std::size_t k = 0; k < kPlanes; ++k) out[k][i] = static_cast<std::uint8_t>(d >> (8 * k));
    }
    for (std::uint8_t*& plane : out) plane += width;
  }
}

void SampleStoreWriter::Impl::add(const Segment& segment) {
  const Tile& tile = segment.tile;
  bool own_start = false;  // unless the pixels start where they were
  for (int y = tile.y; y < tile.y + tile.height && !own_start && segment.t0 != segment.t1; ++y) {
    const float* const row = segment.irradiance0.row(y) + tile.x;
    const std::uint32_t* const before = last.row(y) + tile.x;
    for (int x = 0; x < tile.width; ++x) own_start |= code(row[x]) != before[x];
  }
  segments.push_back({segment.t0, segment.t1, static_cast<std::uint16_t>(tile.x), static_cast<std::uint16_t>(tile.y),
                      static_cast<std::uint16_t>(tile.width), static_cast<std::uint16_t>(tile.height), own_start});
  if (own_start) add(segment.irradiance0, tile);
  add(segment.irradiance1, tile);
}

void SampleStoreWriter::Impl::write_block(const Workers& workers) {
  std::string lists(bytes_of(portions));
  lists += bytes_of(segments);
  std::array<std::string, kPlanes + 1> compressed;
  workers.for_each(static_cast<int>(kPlanes) + 1, [&](int i) {
    const auto k = static_cast<std::size_t>(i);
    compressed[k].clear();
    if (k == kPlanes) {
      compress_zstandard(lists, kLevel, compressed[k]);
    } else if (std::ranges::any_of(planes[k], [](std::uint8_t byte) { return byte != 0; })) {
      compress_zstandard(bytes_of(planes[k]), k == 0 ? kLevelOfLowest : kLevel, compressed[k]);
    }
  });
  BlockHeader header;
  header.portions = static_cast<std::uint32_t>(portions.size());
  header.segments = static_cast<std::uint32_t>(segments.size());
  header.pixels = planes[0].size();
  header.list_bytes = static_cast<std::uint32_t>(compressed[kPlanes].size());
  for (std::size_t k = 0; k < kPlanes; ++k) header.plane_bytes[k] = static_cast<std::uint32_t>(compressed[k].size());
  header.is_key = is_key ? 1 : 0;
  file->append(bytes_of(header));
  for (const std::string& part : compressed) file->append(part);
  file->flush();
  portions.clear();
  segments.clear();
  for (auto& plane : planes) plane.clear();
}

void SampleStoreWriter::Impl::write_end() {
  std::string list;
  compress_zstandard(bytes_of(keys), kLevel, list);
  BlockHeader header;
  header.segments = static_cast<std::uint32_t>(keys.size());
  header.list_bytes = static_cast<std::uint32_t>(list.size());
  const std::uint64_t offset = file->size();
  file->append(bytes_of(header));
  file->append(list);
  file->append(bytes_of(offset));
  file->close();
}

SampleStoreWriter::SampleStoreWriter(const std::filesystem::path& file, const SampleStoreInfo& info)
    : impl_(std::make_unique<Impl>(file, info)) {}
SampleStoreWriter::SampleStoreWriter(const std::filesystem::path& file, const SampleStoreInfo& info,
                                     std::span<const std::byte> state)
    : impl_(std::make_unique<Impl>(file, info, state)) {}
SampleStoreWriter::~SampleStoreWriter() = default;
SampleStoreWriter::SampleStoreWriter(SampleStoreWriter&&) noexcept = default;
SampleStoreWriter& SampleStoreWriter::operator=(SampleStoreWriter&&) noexcept = default;

void SampleStoreWriter::add(std::span<const Segment> segments, TimeNs watermark, const Workers& workers) {
  if (impl_->portions.empty()) impl_->begin_block();
  std::uint64_t count = 0;  // of the portion
  for (const Segment& segment : segments) {
    impl_->add(segment);
    ++count;
    if (!impl_->full()) continue;
    impl_->portions.push_back({impl_->watermark, count});  // divided: the rest follows with the new watermark
    impl_->write_block(workers);
    impl_->begin_block();
    count = 0;
  }
  impl_->portions.push_back({watermark, count});
  impl_->watermark = watermark;
  if (impl_->full()) impl_->write_block(workers);
}

std::vector<std::byte> SampleStoreWriter::state() {
  impl_->file->make_durable();
  std::vector<std::byte> bytes;
  StateWriter archive(bytes);
  archive.value(impl_->file->size());
  Impl::transfer(archive, std::as_const(*impl_));
  return bytes;
}

void SampleStoreWriter::finish(const Workers& workers) {
  if (!impl_->portions.empty()) impl_->write_block(workers);
  impl_->write_end();
}

}  // namespace esim::inline sample_store
