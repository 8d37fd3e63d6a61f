#include "esim/event_camera/segment_history.h"

#include <algorithm>
#include <utility>

namespace esim::inline event_camera {
namespace {

template <typename T>
void make_size(Image<T>& image, const Tile& tile) {
  if (image.width() != tile.width || image.height() != tile.height) image = Image<T>(tile.width, tile.height);
}

/// Copies a view's pixels of the tile, and redirects the view to the copy.
void keep(ImageView<float>& view, Image<float>& copy, const Tile& tile) {
  make_size(copy, tile);
  for (int y = 0; y < tile.height; ++y) std::copy_n(view.row(tile.y + y) + tile.x, tile.width, copy.row(y));
  view = ImageView<float>(copy.data(), tile);
}

template <class Archive, class Past>
void transfer(Archive& archive, Past& past) {
  archive.value(past.segment.tile);
  archive.value(past.segment.t0);
  archive.value(past.segment.t1);
  archive.sized_image(past.light0);
  archive.sized_image(past.light1);
  archive.objects(past.front, [](auto& a, auto& image) { a.sized_image(image); });
  archive.sized_image(past.filtered1);
  archive.sized_image(past.filtered2);
  archive.sized_image(past.start);
  archive.sized_image(past.end);
}

}  // namespace

void SegmentHistory::add(std::span<const Segment> segments, const PixelArray& pixels) {
  width_ = pixels.width, height_ = pixels.height;
  append(segments, !pixels.filtered1.empty(), !pixels.filtered2.empty(), pixels.options.surround_px > 0);
}

void SegmentHistory::add(std::span<const Segment> segments, int width, int height, int front_values) {
  width_ = width, height_ = height;
  append(segments, false, false, false);
  for (std::size_t i = 0; i < segments.size(); ++i) {
    PastSegment& past = segments_[added_ + i];
    past.front.resize(static_cast<std::size_t>(front_values));
    for (Image<double>& image : past.front) make_size(image, segments[i].tile);
  }
}

void SegmentHistory::append(std::span<const Segment> segments, bool filtered1, bool filtered2, bool ends) {
  added_ = count_;
  count_ += segments.size();
  if (segments_.size() < count_) segments_.resize(count_);
  for (std::size_t i = 0; i < segments.size(); ++i) {
    PastSegment& past = segments_[added_ + i];
    past.segment = segments[i];
    if (filtered1) make_size(past.filtered1, segments[i].tile);
    if (filtered2) make_size(past.filtered2, segments[i].tile);
    if (ends) make_size(past.start, segments[i].tile), make_size(past.end, segments[i].tile);
  }
  indexed_ = false;
}

void SegmentHistory::keep_after(TimeNs watermark) {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < count_; ++i) {
    PastSegment& past = segments_[i];
    const Segment& segment = past.segment;
    if (segment.t0 == segment.t1 || segment.t1 <= watermark) continue;
    if (i >= added_) {  // the others have already been copied
      keep(past.segment.irradiance0, past.light0, segment.tile);
      keep(past.segment.irradiance1, past.light1, segment.tile);
    }
    if (kept != i) std::swap(segments_[kept], past);
    ++kept;
  }
  count_ = added_ = kept;
  indexed_ = false;
}

void SegmentHistory::index() {
  first_seen_.assign(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_), kNone);
  next_.assign(count_, kNone);
  for (std::size_t i = count_; i-- > 0;) {
    const Segment& segment = segments_[i].segment;
    if (segment.t0 == segment.t1) continue;
    const Tile& tile = segment.tile;
    for (int y = tile.y; y < tile.y + tile.height; ++y) {
      std::uint32_t* const row = first_seen_.data() + static_cast<std::ptrdiff_t>(y) * width_;
      if (y == tile.y) next_[i] = row[tile.x];
      std::fill_n(row + tile.x, tile.width, static_cast<std::uint32_t>(i));
    }
  }
  indexed_ = true;
}

void SegmentHistory::save(StateWriter& archive) const {
  archive.value(width_);
  archive.value(height_);
  archive.objects(std::span(segments_).first(count_), [](auto& a, const PastSegment& past) { transfer(a, past); });
}

void SegmentHistory::restore(StateReader& archive) {
  archive.value(width_);
  archive.value(height_);
  archive.objects(segments_, [](auto& a, PastSegment& past) {
    transfer(a, past);
    Segment& segment = past.segment;
    for (const Image<float>* light : {&past.light0, &past.light1}) {
      if (light->width() != segment.tile.width || light->height() != segment.tile.height) StateReader::fail();
    }
    segment.irradiance0 = ImageView<float>(past.light0.data(), segment.tile);
    segment.irradiance1 = ImageView<float>(past.light1.data(), segment.tile);
  });
  count_ = added_ = segments_.size();
  indexed_ = false;
}

std::uint32_t SegmentHistory::find(std::uint32_t pixel, TimeNs t) {
  if (!indexed_) index();
  std::uint32_t i = first_seen_[pixel];
  while (i != kNone && segments_[i].segment.t1 < t) i = next_[i];
  return i;
}

}  // namespace esim::inline event_camera
