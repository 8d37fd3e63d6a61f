#include "esim/frame_camera/frame_camera.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cassert>
#include <cstddef>
#include <deque>
#include <optional>
#include <utility>
#include <vector>

#include "esim/core/error.h"
#include "esim/frame_camera/exposure.h"
#include "esim/frame_camera/readout.h"
#include "esim/render/irradiance_check.h"

namespace esim::inline frame_camera {
namespace {

constexpr int kPixelsPerPiece = 16384;  // per task of a parallel loop

// Exposures that are accumulated at the same time. An automatic exposure depends on the one two frames earlier.
constexpr std::size_t kExposures = 4, kAutoExposures = 2;

[[noreturn]] void fail(const char* option, const std::string& what) {
  throw UserError(fmt::format("frame_camera.{}: {}", option, what));
}

/// Checks the options for contradictions, and returns them.
const FrameCameraOptions& checked(const FrameCameraOptions& o, int height) {
  const double interval_s = 1 / o.rate_hz, slack = 1 + 1e-9;
  const auto check_exposure = [&](const char* option, double exposure_s) {
    if (exposure_s <= interval_s * slack) return;
    fail(option, fmt::format("{} s is longer than the frame interval, {:.6g} s; shorten it, or lower rate_hz = {}",
                             exposure_s, interval_s, o.rate_hz));
  };
  check_exposure("exposure_s", o.exposure_s);
  if (o.line_delay_s * height > interval_s * slack) {
    fail("line_delay_s", fmt::format("{} rows take {:.6g} s to read, longer than the frame interval, {:.6g} s; shorten "
                                     "it, or lower rate_hz = {}",
                                     height, o.line_delay_s * height, interval_s, o.rate_hz));
  }
  if (o.black_level >= o.largest_number())
    fail("black_level", fmt::format("{} leaves no range within {} bits", o.black_level, o.bits));
  if (!o.auto_exposure) return o;
  const double min = o.auto_exposure->min_exposure_s, max = o.auto_exposure->max_exposure_s.value_or(interval_s);
  check_exposure("auto_exposure.max_exposure_s", max);
  if (min > max)
    fail("auto_exposure.min_exposure_s", fmt::format("{} s is above max_exposure_s, {:.6g} s; swap them", min, max));
  if (o.exposure_s < min || o.exposure_s > max * slack) {
    fail("exposure_s",
         fmt::format("{} s, the first exposure, must be between min_exposure_s = {} s and max_exposure_s = "
                     "{:.6g} s of auto_exposure",
                     o.exposure_s, min, max));
  }
  return o;
}

TimeNs duration_of(double seconds) { return std::max<TimeNs>(1, to_ns(seconds)); }

/// Throws UserError, naming pixel and time, unless all of a segment's irradiances are finite numbers >= 0.
void check_both_ends(const Segment& segment) {
  check_irradiance({segment.tile, segment.t0, segment.t0, segment.irradiance0, segment.irradiance0});
  check_irradiance(segment);
}

/// A tile's part of an image.
template <typename T>
Image<T> part(const ImageView<T>& image, const Tile& tile) {
  Image<T> copy(tile.width, tile.height);
  for (int y = 0; y < tile.height; ++y)
    std::copy_n(image.row(tile.y + y) + tile.x, static_cast<std::size_t>(tile.width), copy.row(y));
  return copy;
}

}  // namespace

/// The current exposures, and the segments that later ones need.
struct FrameCamera::State {
  /// Rows of a tile, with the tile's segments among the given ones.
  struct Piece {
    std::size_t first, last;
    Rows rows;
  };
  /// A copy of a tile's segment in a time whose exposures are not planned yet.
  struct Held {
    Tile tile;
    TimeNs t0, t1;
    Image<float> irradiance0, irradiance1;        // of the tile's size
    Image<std::uint16_t> objects0{}, objects1{};  // the same; only if objects are lights
  };

  State(const FrameCameraOptions& o, int width, int height, TimeSpan simulated, std::uint64_t seed,
        std::uint16_t stream);

  TimeNs centre(std::int64_t frame) const;
  bool plan();
  void open(Exposure& exposure);
  void expose(std::span<const Segment> segments, const Workers& workers);
  std::optional<SegmentLight> light_of(std::size_t segment) const;
  void cut(std::span<const Segment> segments);
  void hold(const Segment& segment, const SegmentLight* light);
  void expose_held(Exposure& exposure);
  void finish_first(const Workers& workers);
  void adapt(const CameraFrame& frame);

  /// Everything except the current exposures and working memory.
  template <class Archive, class Self>
  static void transfer(Archive& archive, Self& self) {
    archive.value(self.number);
    archive.value(self.next_exposure);
    archive.value(self.horizon);
    archive.value(self.spoiled);
    archive.objects(self.finished, [](auto& a, auto& frame) {
      a.value(frame.t);
      a.value(frame.exposure_start);
      a.value(frame.exposure);
      a.value(frame.exposure_end);
      a.sized_image(frame.numbers);
    });
    archive.objects(self.held, [](auto& a, auto& part) {
      a.value(part.tile);
      a.value(part.t0);
      a.value(part.t1);
      a.sized_image(part.irradiance0);
      a.sized_image(part.irradiance1);
      a.sized_image(part.objects0);
      a.sized_image(part.objects1);
    });
  }

  FrameCameraOptions options;
  Tile image;
  TimeSpan span;
  FrameReadout readout;
  TimeNs to_first_row;             // from a frame's middle row
  std::vector<TimeNs> row_delays;  // from the first row on
  TimeNs shortest, longest;        // possible exposures

  std::int64_t number = 0;  // of the next planned frame
  TimeNs next_exposure;     // its exposure, as far as known
  TimeNs horizon = 0;       // earliest possible start of it; kNever after the last frame
  std::deque<Exposure> exposing;
  std::deque<CameraFrame> finished;
  const Flicker* flicker = nullptr;  // of the current call
  std::vector<Held> held;
  std::vector<Image<float>> memory;  // of finished exposures, to reuse
  std::vector<Piece> pieces;
  bool spoiled = false;
};

FrameCamera::State::State(const FrameCameraOptions& o, int width, int height, TimeSpan simulated, std::uint64_t seed,
                          std::uint16_t stream)
    : options(checked(o, height)),
      image{0, 0, width, height},
      span(simulated),
      readout(o, seed, stream),
      shortest(duration_of(options.exposure_s)),
      longest(shortest),
      next_exposure(shortest) {
  const auto after_middle = [&](int y) { return to_ns(options.line_delay_s * (y - 0.5 * (height - 1))); };
  to_first_row = after_middle(0);
  for (int y = 0; y < height; ++y) row_delays.push_back(after_middle(y) - to_first_row);
  if (const auto& automatic = options.auto_exposure) {
    shortest = duration_of(automatic->min_exposure_s);
    longest = duration_of(automatic->max_exposure_s.value_or(1 / options.rate_hz));
  }
  while (centre(number) - next_exposure / 2 + to_first_row < span.start) ++number;
  for (std::size_t i = 0; i < (options.auto_exposure ? kAutoExposures : kExposures); ++i) plan();
}

TimeNs FrameCamera::State::centre(std::int64_t frame) const {
  return span.start + to_ns(static_cast<double>(frame) / options.rate_hz);
}

/// Starts the next frame; false after the last one.
bool FrameCamera::State::plan() {
  const Exposure next(number, centre(number) - next_exposure / 2 + to_first_row, next_exposure, row_delays);
  if (horizon == kNever || next.end() > span.end) {
    horizon = kNever;
    return false;
  }
  exposing.push_back(next);
  ++number;
  horizon = centre(number) - longest / 2 + to_first_row;
  return true;
}

/// Divides the segments into tasks with disjoint pixels.
void FrameCamera::State::cut(std::span<const Segment> segments) {
  pieces.clear();
  for (std::size_t first = 0, last = 0; first < segments.size(); first = last) {
    const Tile& tile = segments[first].tile;
    while (last < segments.size() && segments[last].tile == tile) ++last;
    const int rows = std::max(1, kPixelsPerPiece / std::max(1, tile.width)), end = tile.y + tile.height;
    for (int y = tile.y; y < end; y += rows) pieces.push_back({first, last, {y, std::min(y + rows, end)}});
  }
}

/// Allocates the memory of an exposure.
void FrameCamera::State::open(Exposure& exposure) {
  if (exposure.is_open()) return;
  if (memory.empty()) memory.emplace_back(image.width, image.height);
  exposure.open(std::move(memory.back()));
  memory.pop_back();
}

/// The light of one of the current segments; empty if it is constant.
std::optional<SegmentLight> FrameCamera::State::light_of(std::size_t segment) const {
  if (flicker == nullptr) return std::nullopt;
  return flicker->light_of(segment);
}

/// Adds segments to the current exposures.
void FrameCamera::State::expose(std::span<const Segment> segments, const Workers& workers) {
  TimeNs first = kNever, last = std::numeric_limits<TimeNs>::min();
  for (const Segment& segment : segments) first = std::min(first, segment.t0), last = std::max(last, segment.t1);
  bool any = false;
  for (Exposure& exposure : exposing) {
    if (!exposure.overlaps(first, last)) continue;
    any = true;
    open(exposure);
  }
  if (!any) return;
  cut(segments);
  std::atomic<bool> good = true;
  workers.for_each(static_cast<int>(pieces.size()), [&](int i) {
    const Piece& piece = pieces[static_cast<std::size_t>(i)];
    for (std::size_t k = piece.first; k < piece.last; ++k) {
      const std::optional<SegmentLight> light = light_of(k);
      for (Exposure& exposure : exposing) {
        if (!exposure.overlaps(segments[k].t0, segments[k].t1)) continue;
        if (!exposure.add(segments[k], piece.rows, light ? &*light : nullptr)) good = false;
      }
    }
  });
  if (good) return;
  for (const Segment& segment : segments) check_both_ends(segment);
}

/// Keeps a copy of a segment that ends after the horizon.
void FrameCamera::State::hold(const Segment& segment, const SegmentLight* light) {
  check_both_ends(segment);
  held.push_back({segment.tile, segment.t0, segment.t1, part(segment.irradiance0, segment.tile),
                  part(segment.irradiance1, segment.tile)});
  if (light == nullptr || !light->scene->has_sources()) return;
  held.back().objects0 = part(light->before, segment.tile);
  held.back().objects1 = part(light->after, segment.tile);
}

/// Reads out the exposure that ends first, and starts another one.
void FrameCamera::State::finish_first(const Workers& workers) {
  Exposure& over = exposing.front();
  open(over);
  CameraFrame frame{.t = centre(over.number()),
                    .exposure_start = over.first_row(),
                    .exposure = over.duration(),
                    .exposure_end = over.end(),
                    .numbers = Image<std::uint16_t>(image.width, image.height)};
  const double relative = to_seconds(over.duration()) / options.exposure_s;
  readout.read(over.mean(), relative, over.number(), workers, frame.numbers);
  memory.push_back(over.take_memory());
  exposing.pop_front();
  if (options.auto_exposure) adapt(frame);
  finished.push_back(std::move(frame));
  if (plan()) expose_held(exposing.back());
  std::erase_if(held, [&](const Held& part) { return part.t1 <= horizon; });
}

/// Adds the held segments to a new exposure.
void FrameCamera::State::expose_held(Exposure& exposure) {
  for (const auto& [tile, t0, t1, irradiance0, irradiance1, objects0, objects1] : held) {
    if (!exposure.overlaps(t0, t1)) continue;
    open(exposure);
    SegmentLight light;
    if (flicker != nullptr) light = {&flicker->light(), {objects0.data(), tile}, {objects1.data(), tile}};
    exposure.add({tile, t0, t1, {irradiance0.data(), tile}, {irradiance1.data(), tile}}, {tile.y, tile.y + tile.height},
                 flicker != nullptr ? &light : nullptr);
  }
}

/// Sets the exposure of the next frame from that of this frame.
void FrameCamera::State::adapt(const CameraFrame& frame) {
  constexpr double kLongest = 1e18;  // limit of the representable times
  const double signal = readout.signal_of(readout.mean_level(frame.numbers));
  const double wanted = readout.signal_of(options.auto_exposure->target);
  const double exposure = signal > 0 ? static_cast<double>(frame.exposure) * (wanted / signal) : kLongest;
  next_exposure = std::clamp(static_cast<TimeNs>(std::min(exposure, kLongest)), shortest, longest);
}

FrameCamera::FrameCamera(const FrameCameraOptions& options, int width, int height, TimeSpan span, std::uint64_t seed,
                         std::uint16_t stream)
    : state_(std::make_unique<State>(options, width, height, span, seed, stream)) {}

FrameCamera::~FrameCamera() = default;
FrameCamera::FrameCamera(FrameCamera&&) noexcept = default;
FrameCamera& FrameCamera::operator=(FrameCamera&&) noexcept = default;

void FrameCamera::integrate(std::span<const Segment> segments, TimeNs watermark, const Workers& workers,
                            const Flicker* flicker) {
  State& state = *state_;
  state.flicker = flicker;
  if (state.spoiled)
    throw UserError("frame camera: an earlier irradiance was invalid, and the camera cannot go on; create a new one");
  state.spoiled = true;  // reset on success
  state.expose(segments, workers);
  for (std::size_t i = 0; i < segments.size(); ++i) {
    if (segments[i].t1 <= state.horizon) continue;
    const std::optional<SegmentLight> light = state.light_of(i);
    state.hold(segments[i], light ? &*light : nullptr);
  }
  while (!state.exposing.empty() && state.exposing.front().end() <= watermark) state.finish_first(workers);
  state.spoiled = false;
}

TimeNs FrameCamera::due() const {
  if (!state_->finished.empty()) return state_->finished.front().exposure_end;
  return state_->exposing.empty() ? kNever : state_->exposing.front().end();
}

void FrameCamera::save(StateWriter& archive) const {
  State::transfer(archive, *state_);
  archive.objects(state_->exposing, [](StateWriter& a, const Exposure& exposure) {
    a.value(exposure.number());
    a.value(exposure.first_row());
    a.value(exposure.duration());
    a.sized_image(exposure.mean());
  });
}

void FrameCamera::restore(StateReader& archive) {
  State& state = *state_;
  State::transfer(archive, state);
  state.exposing.clear();
  std::uint64_t count = 0;
  archive.value(count);
  for (std::uint64_t i = 0; i < count; ++i) {
    std::int64_t number = 0;
    TimeNs first_row = 0, duration = 0;
    Image<float> mean;
    archive.value(number);
    archive.value(first_row);
    archive.value(duration);
    archive.sized_image(mean);
    state.exposing.emplace_back(number, first_row, duration, state.row_delays).restore(std::move(mean));
  }
}

const FrameCameraOptions& FrameCamera::options() const { return state_->options; }

CameraFrame FrameCamera::take() {
  assert(!state_->finished.empty());
  CameraFrame frame = std::move(state_->finished.front());
  state_->finished.pop_front();
  return frame;
}

}  // namespace esim::inline frame_camera
