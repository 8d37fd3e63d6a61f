#include "esim/sensors/event_camera.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "esim/core/error.h"

namespace esim {
namespace {

constexpr TimeNs kReady = std::numeric_limits<TimeNs>::min();
constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr int kRowsPerPiece = 8;

// Relative room between the band and the levels, many times the rounding of a float: the band may wake a pixel for
// nothing, but never lets it sleep over a crossing.
constexpr double kBandGuard = 1e-6;

[[noreturn]] void refuse_irradiance(float value, int x, int y, TimeNs t) {
  throw UserError("event camera: irradiance " + std::to_string(value) + " of pixel (" + std::to_string(x) + ", " +
                  std::to_string(y) + ") at t = " + std::to_string(to_seconds(t)) +
                  " s is not a finite number >= 0; check the renderer's images");
}

bool is_irradiance(float value) { return value >= 0 && value < kInfinity; }

}  // namespace

EventCamera::EventCamera(const EventCameraOptions& options, int width, int height, std::uint64_t seed,
                         std::uint16_t stream)
    : options_(options),
      width_(width),
      refractory_(to_ns(options.refractory_period_us * 1e-6)),
      noise_(seed, Purpose::threshold_noise, stream) {
  const std::size_t pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  band_low_.assign(pixels, kInfinity);
  band_high_.assign(pixels, -kInfinity);
  reference_.assign(pixels, 0.0);
  reset_until_.assign(pixels, kReady);
  draws_.assign(pixels, 0);

  const AddressedRandom mismatch(seed, Purpose::threshold_mismatch, stream);
  mean_on_.resize(pixels);
  mean_off_.resize(pixels);
  for (std::size_t i = 0; i < pixels; ++i) {
    const auto [on, off] =
        options.threshold_mismatch > 0 ? mismatch.normals(static_cast<std::uint32_t>(i)) : std::array{0.0, 0.0};
    mean_on_[i] = static_cast<float>(options.threshold_on() + options.threshold_mismatch * on);
    mean_off_[i] = static_cast<float>(options.threshold_off() + options.threshold_mismatch * off);
  }
  threshold_on_.resize(pixels);
  threshold_off_.resize(pixels);
  for (std::size_t i = 0; i < pixels; ++i) draw_thresholds(i);
}

void EventCamera::draw_thresholds(std::size_t pixel) {
  double on = mean_on_[pixel], off = mean_off_[pixel];
  if (options_.threshold_noise > 0) {
    const auto [noise_on, noise_off] = noise_.normals(static_cast<std::uint32_t>(pixel), draws_[pixel]++);
    on += options_.threshold_noise * noise_on;
    off += options_.threshold_noise * noise_off;
  }
  threshold_on_[pixel] = static_cast<float>(std::max(on, kMinContrastThreshold));
  threshold_off_[pixel] = static_cast<float>(std::max(off, kMinContrastThreshold));
}

void EventCamera::set_band(std::size_t pixel) {
  const double rise = std::exp(reference_[pixel] + threshold_on_[pixel]) * (1.0 - kBandGuard);
  const double fall = std::exp(reference_[pixel] - threshold_off_[pixel]) * (1.0 + kBandGuard);
  band_high_[pixel] = static_cast<float>(rise - options_.log_eps);
  band_low_[pixel] = static_cast<float>(fall - options_.log_eps);
}

/// One pixel's brightness over one segment, and its way through the levels.
struct EventCamera::Crossings {
  EventCamera& camera;
  const Segment& segment;
  std::size_t pixel;
  double brightness0, brightness1;  // L at t0 and t1

  double brightness_at(TimeNs t) const {
    const double fraction = static_cast<double>(t - segment.t0) / static_cast<double>(segment.t1 - segment.t0);
    return brightness0 + (brightness1 - brightness0) * fraction;
  }

  /// Time at which L passes `level`, in (t0, t1].
  TimeNs time_of(double level) const {
    const double fraction = (level - brightness0) / (brightness1 - brightness0);
    const TimeNs t = segment.t0 + std::llround(fraction * static_cast<double>(segment.t1 - segment.t0));
    return std::clamp(t, segment.t0 + 1, segment.t1);
  }

  /// Ends the refractory period if it ends in this segment: the reference is the brightness of that moment.
  /// False while the pixel stays in reset.
  bool wake() {
    TimeNs& until = camera.reset_until_[pixel];
    if (until == kReady) return true;
    if (until > segment.t1) return false;
    camera.reference_[pixel] = brightness_at(until);
    until = kReady;
    return true;
  }

  void fire_all(int x, int y, std::vector<Event>& events) {
    double& reference = camera.reference_[pixel];
    while (wake()) {
      const double rise = reference + camera.threshold_on_[pixel], fall = reference - camera.threshold_off_[pixel];
      const bool on = brightness1 >= rise, off = brightness1 <= fall;
      if (!on && !off) return camera.set_band(pixel);

      reference = on ? rise : fall;
      const TimeNs t = time_of(reference);
      events.push_back(
          {t, static_cast<std::uint16_t>(x), static_cast<std::uint16_t>(y), static_cast<std::int8_t>(on ? 1 : -1)});
      camera.draw_thresholds(pixel);
      if (camera.refractory_ > 0) camera.reset_until_[pixel] = t + camera.refractory_;
    }
    // In reset: an empty band, so that the next segment looks at this pixel again.
    camera.band_low_[pixel] = kInfinity;
    camera.band_high_[pixel] = -kInfinity;
  }
};

void EventCamera::open(const Segment& segment, int y) {
  for (int x = segment.tile.x; x < segment.tile.x + segment.tile.width; ++x) {
    const float irradiance = (*segment.irradiance1)(x, y);
    if (!is_irradiance(irradiance)) refuse_irradiance(irradiance, x, y, segment.t1);
    const std::size_t pixel =
        static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x);
    reference_[pixel] = std::log(irradiance + options_.log_eps);
    reset_until_[pixel] = kReady;
    set_band(pixel);
  }
}

void EventCamera::integrate_row(const Segment& segment, int y, std::vector<Event>& events) {
  constexpr int kBlock = 32;
  const std::size_t row = static_cast<std::size_t>(y) * static_cast<std::size_t>(width_);
  const float *const before = segment.irradiance0->row(y), *const after = segment.irradiance1->row(y);
  const float *const low = band_low_.data() + row, *const high = band_high_.data() + row;
  const int end = segment.tile.x + segment.tile.width;

  std::array<std::uint8_t, kBlock> awake;
  for (int first = segment.tile.x; first < end; first += kBlock) {
    // Which pixels of the block may have left their band? NaN has.
    const int count = std::min(kBlock, end - first);
    int any = 0;
#pragma omp simd reduction(| : any)
    for (int i = 0; i < count; ++i) {
      const bool asleep = after[first + i] > low[first + i] && after[first + i] < high[first + i];
      awake[static_cast<unsigned>(i)] = !asleep;
      any |= !asleep;
    }
    if (any == 0) continue;

    for (int i = 0; i < count; ++i) {
      if (awake[static_cast<unsigned>(i)] == 0) continue;
      const int x = first + i;
      if (!is_irradiance(after[x])) refuse_irradiance(after[x], x, y, segment.t1);
      Crossings crossings{*this, segment, row + static_cast<std::size_t>(x), std::log(before[x] + options_.log_eps),
                          std::log(after[x] + options_.log_eps)};
      crossings.fire_all(x, y, events);
    }
  }
}

void EventCamera::integrate(std::span<const Segment> segments, const Workers& workers) {
  for (const Segment& segment : segments) {
    const Tile& tile = segment.tile;
    const int pieces = (tile.height + kRowsPerPiece - 1) / kRowsPerPiece;
    if (piece_events_.size() < static_cast<std::size_t>(pieces)) piece_events_.resize(static_cast<std::size_t>(pieces));

    workers.for_each(pieces, [&](int piece) {
      const int first = tile.y + piece * kRowsPerPiece, last = std::min(first + kRowsPerPiece, tile.y + tile.height);
      for (int y = first; y < last; ++y) {
        if (segment.t0 == segment.t1) {
          open(segment, y);
        } else {
          integrate_row(segment, y, piece_events_[static_cast<std::size_t>(piece)]);
        }
      }
    });

    std::vector<Event>& incoming = queue_.incoming();
    for (int piece = 0; piece < pieces; ++piece) {
      std::vector<Event>& events = piece_events_[static_cast<std::size_t>(piece)];
      incoming.insert(incoming.end(), events.begin(), events.end());
      events.clear();
    }
  }
}

}  // namespace esim
