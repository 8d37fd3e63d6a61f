#include "esim/sensors/event_camera.h"

#include <hwy/highway.h>
//
#include <hwy/contrib/math/math-inl.h>

#include <algorithm>
#include <array>
#include <bit>
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
  pixels_.assign(pixels, Pixel{.reset_until = kReady});
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
  for (std::size_t i = 0; i < pixels; ++i) draw_thresholds(i);
}

EventCamera::~EventCamera() = default;
EventCamera::EventCamera(EventCamera&&) noexcept = default;
EventCamera& EventCamera::operator=(EventCamera&&) noexcept = default;

void EventCamera::draw_thresholds(std::size_t pixel) {
  double on = mean_on_[pixel], off = mean_off_[pixel];
  if (options_.threshold_noise > 0) {
    const auto [noise_on, noise_off] = noise_.normals(static_cast<std::uint32_t>(pixel), draws_[pixel]++);
    on += options_.threshold_noise * noise_on;
    off += options_.threshold_noise * noise_off;
  }
  pixels_[pixel].rise = std::exp(std::max(on, kMinContrastThreshold));
  pixels_[pixel].fall = std::exp(-std::max(off, kMinContrastThreshold));
}

void EventCamera::set_band(std::size_t pixel, double rise, double fall) {
  band_high_[pixel] = static_cast<float>(rise * (1.0 - kBandGuard) - options_.log_eps);
  band_low_[pixel] = static_cast<float>(fall * (1.0 + kBandGuard) - options_.log_eps);
}

/// The pixels of some rows of a segment that have left their bands, and their way through the levels. All of them take
/// one step at a time, so that logarithms and exponentials are computed for many pixels at once.
class EventCamera::Crossings {
 public:
  std::vector<Event> events;

  void collect(const EventCamera& camera, const Segment& segment, int y);
  void run(EventCamera& camera, const Segment& segment);

 private:
  /// One pixel in this segment. Light is E + log_eps; in between, its logarithm is linear in time.
  struct Active {
    double before, after;  // light at the segment's ends
    double slope;          // ln(after / before)
    double level;          // light at the crossing
    std::uint32_t pixel;
    std::uint16_t x, y;
    std::int8_t polarity;
  };

  void wake_up(EventCamera& camera, const Segment& segment);
  template <typename Reference>
  void find_levels(EventCamera& camera, const Reference& reference_of);
  void fire(EventCamera& camera, const Segment& segment);

  std::vector<Active> active_;
  std::size_t count_ = 0;      // of active_
  std::vector<double> value_;  // per active pixel: argument and result of the vector functions
};

namespace {

/// values[i] = f(d, values[i]) for whole vectors that cover `count` elements.
template <typename Function>
void for_vectors(std::size_t count, double* values, const Function& f) {
  namespace hn = hwy::HWY_NAMESPACE;
  const hn::ScalableTag<double> d;
  for (std::size_t i = 0; i < count; i += hn::Lanes(d)) hn::StoreU(f(d, hn::LoadU(d, values + i)), d, values + i);
}

void logarithms(std::size_t count, double* values) {
  for_vectors(count, values, [](auto d, auto x) { return hwy::HWY_NAMESPACE::Log(d, x); });
}

void exponentials(std::size_t count, double* values) {
  for_vectors(count, values, [](auto d, auto x) { return hwy::HWY_NAMESPACE::Exp(d, x); });
}

}  // namespace

void EventCamera::Crossings::collect(const EventCamera& camera, const Segment& segment, int y) {
  namespace hn = hwy::HWY_NAMESPACE;
  const hn::ScalableTag<float> d;
  const int lanes = static_cast<int>(hn::Lanes(d));
  const std::size_t row = static_cast<std::size_t>(y) * static_cast<std::size_t>(camera.width_);
  const float *const before = segment.irradiance0->row(y), *const after = segment.irradiance1->row(y);
  const float *const low = camera.band_low_.data() + row, *const high = camera.band_high_.data() + row;
  const std::size_t most = count_ + static_cast<std::size_t>(segment.tile.width);
  if (active_.size() < most) active_.resize(2 * most);
  const double eps = camera.options_.log_eps;
  const auto add = [&](int x) {
    if (!is_irradiance(after[x])) refuse_irradiance(after[x], x, y, segment.t1);
    const std::size_t pixel = row + static_cast<std::size_t>(x);
    __builtin_prefetch(&camera.pixels_[pixel]);
    active_[count_++] = {.before = before[x] + eps,
                         .after = after[x] + eps,
                         .slope = 0,
                         .level = 0,
                         .pixel = static_cast<std::uint32_t>(pixel),
                         .x = static_cast<std::uint16_t>(x),
                         .y = static_cast<std::uint16_t>(y),
                         .polarity = 0};
  };

  // Which pixels may have left their band? NaN has.
  int x = segment.tile.x;
  const int end = x + segment.tile.width;
  for (; x + lanes <= end; x += lanes) {
    const auto value = hn::LoadU(d, after + x);
    const auto asleep = hn::And(hn::Gt(value, hn::LoadU(d, low + x)), hn::Lt(value, hn::LoadU(d, high + x)));
    std::uint64_t awake = 0;
    hn::StoreMaskBits(d, hn::Not(asleep), reinterpret_cast<std::uint8_t*>(&awake));
    for (; awake != 0; awake &= awake - 1) add(x + std::countr_zero(awake));
  }
  for (; x < end; ++x) {
    if (!(after[x] > low[x] && after[x] < high[x])) add(x);
  }
}

void EventCamera::Crossings::run(EventCamera& camera, const Segment& segment) {
  constexpr std::size_t kPadding = 8;  // the values are read in whole vectors
  if (value_.size() < count_ + kPadding) value_.resize(2 * count_ + kPadding, 1.0);
  double* const value = value_.data();
  Active* const active = active_.data();

  for (std::size_t i = 0; i < count_; ++i) value[i] = active[i].after / active[i].before;
  logarithms(count_, value);
  for (std::size_t i = 0; i < count_; ++i) active[i].slope = value[i];
  if (camera.refractory_ > 0) wake_up(camera, segment);
  find_levels(camera, [&](std::size_t i) { return camera.pixels_[active[i].pixel].reference; });

  while (count_ > 0) {
    for (std::size_t i = 0; i < count_; ++i) value[i] = active[i].level / active[i].before;
    logarithms(count_, value);
    fire(camera, segment);
    if (camera.refractory_ == 0) {
      find_levels(camera, [&](std::size_t i) { return active[i].level; });
    } else {
      exponentials(count_, value);
      find_levels(camera, [&](std::size_t i) { return active[i].before * value[i]; });
    }
  }
}

/// Ends the refractory periods that end in this segment: the reference is the light of that moment. Pixels that stay in
/// reset are dropped.
void EventCamera::Crossings::wake_up(EventCamera& camera, const Segment& segment) {
  const double per_ns = 1.0 / static_cast<double>(segment.t1 - segment.t0);
  std::size_t kept = 0;
  for (std::size_t i = 0; i < count_; ++i) {
    const Active& active = active_[i];
    Pixel& pixel = camera.pixels_[active.pixel];
    if (pixel.reset_until != kReady) {
      if (pixel.reset_until > segment.t1) continue;
      pixel.reference =
          active.before * std::exp(active.slope * static_cast<double>(pixel.reset_until - segment.t0) * per_ns);
      pixel.reset_until = kReady;
    }
    if (kept != i) active_[kept] = active;
    ++kept;
  }
  count_ = kept;
}

/// Gives each pixel its reference, and finds the level that it reaches next. Those that reach none get their band back,
/// and are dropped.
template <typename Reference>
void EventCamera::Crossings::find_levels(EventCamera& camera, const Reference& reference_of) {
  Pixel* const pixels = camera.pixels_.data();
  Active* const active = active_.data();
  const std::size_t count = count_;
  std::size_t kept = 0;
  for (std::size_t i = 0; i < count; ++i) {
    Active now = active[i];
    Pixel& pixel = pixels[now.pixel];
    const double reference = reference_of(i);
    const double rise = reference * pixel.rise, fall = reference * pixel.fall;
    pixel.reference = reference;
    const bool on = now.after >= rise, off = now.after <= fall;
    if (!on && !off) {
      camera.set_band(now.pixel, rise, fall);
      continue;
    }
    now.level = on ? rise : fall;
    now.polarity = static_cast<std::int8_t>(on ? 1 : -1);
    active[kept++] = now;
  }
  count_ = kept;
}

/// One event per pixel, at the time at which it passes its level: value_ holds ln(level / before). Afterwards, with a
/// refractory period, it holds ln(light at its end / before), and pixels that stay in reset are dropped.
void EventCamera::Crossings::fire(EventCamera& camera, const Segment& segment) {
  const double duration = static_cast<double>(segment.t1 - segment.t0), per_ns = 1.0 / duration;
  const TimeNs t0 = segment.t0, t1 = segment.t1, refractory = camera.refractory_;
  const bool noisy = camera.options_.threshold_noise > 0;
  Active* const active = active_.data();
  double* const value = value_.data();
  const std::size_t count = count_, first = events.size();
  events.resize(first + count);
  std::size_t kept = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const Active& now = active[i];
    const double fraction = now.slope != 0 ? value[i] / now.slope : 1.0;
    const TimeNs t = std::clamp<TimeNs>(t0 + static_cast<TimeNs>(std::nearbyint(fraction * duration)), t0 + 1, t1);
    events[first + i] = {t, now.x, now.y, now.polarity};
    if (noisy) camera.draw_thresholds(now.pixel);
    if (refractory > 0) {
      const TimeNs until = t + refractory;
      if (until > t1) {
        // An empty band, so that the next segment looks at this pixel again.
        camera.pixels_[now.pixel].reset_until = until;
        camera.band_low_[now.pixel] = kInfinity;
        camera.band_high_[now.pixel] = -kInfinity;
        continue;
      }
      value[kept] = now.slope * (static_cast<double>(until - t0) * per_ns);
    }
    if (kept != i) active[kept] = now;
    ++kept;
  }
  count_ = kept;
}

void EventCamera::open(const Segment& segment, int y) {
  for (int x = segment.tile.x; x < segment.tile.x + segment.tile.width; ++x) {
    const float irradiance = (*segment.irradiance1)(x, y);
    if (!is_irradiance(irradiance)) refuse_irradiance(irradiance, x, y, segment.t1);
    const std::size_t pixel =
        static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x);
    Pixel& state = pixels_[pixel];
    state.reference = irradiance + options_.log_eps;
    state.reset_until = kReady;
    set_band(pixel, state.reference * state.rise, state.reference * state.fall);
  }
}

void EventCamera::integrate(std::span<const Segment> segments, const Workers& workers) {
  for (const Segment& segment : segments) {
    const Tile& tile = segment.tile;
    const int pieces = (tile.height + kRowsPerPiece - 1) / kRowsPerPiece;
    if (pieces_.size() < static_cast<std::size_t>(pieces)) pieces_.resize(static_cast<std::size_t>(pieces));

    workers.for_each(pieces, [&](int piece) {
      const int first = tile.y + piece * kRowsPerPiece, last = std::min(first + kRowsPerPiece, tile.y + tile.height);
      Crossings& crossings = pieces_[static_cast<std::size_t>(piece)];
      for (int y = first; y < last; ++y) {
        if (segment.t0 == segment.t1) {
          open(segment, y);
        } else {
          crossings.collect(*this, segment, y);
        }
      }
      crossings.run(*this, segment);
    });

    std::vector<Event>& incoming = queue_.incoming();
    for (int piece = 0; piece < pieces; ++piece) {
      std::vector<Event>& events = pieces_[static_cast<std::size_t>(piece)].events;
      incoming.insert(incoming.end(), events.begin(), events.end());
      events.clear();
    }
  }
}

}  // namespace esim
