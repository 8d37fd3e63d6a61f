#include "esim/fit/circuit/pixel_counts.h"

#include <fmt/format.h>

#include <algorithm>
#include <numbers>

namespace esim::inline fit {
namespace {

constexpr std::uint64_t kFewestEvents = 500, kFewestOff = 100;
constexpr std::int64_t kFewestPeriods = 10;
constexpr double kClearPhase = 0.2;  // mean resultant length of phases that follow a lamp

}  // namespace

std::string PixelCounts::name() const {
  const std::string lux = std::isnan(light.lux) ? "? lux" : fmt::format("{:.4g} lux", light.lux);
  const std::string what =
      light.flickers() ? fmt::format("{:.6g} Hz at {}", light.frequency_hz, lux) : "constant " + lux;
  return file.empty() ? what : fmt::format("{} ({})", file, what);
}

double PixelCounts::rate_hz() const {
  std::uint64_t events = 0;
  for (const Pixel& pixel : pixels.pixels()) events += std::uint64_t{pixel.on} + pixel.off;
  const double duration_s = light.flickers() ? extent / light.frequency_hz : extent;
  return duration_s > 0 ? static_cast<double>(events) / (duration_s * static_cast<double>(pixels.size())) : 0;
}

void PixelCounter::count(const Event& event) {
  PixelCounts::Pixel& pixel = pixels_(event.x, event.y);
  ++(event.polarity > 0 ? pixel.on : pixel.off);
  ++(event.polarity > 0 ? on_ : off_);
}

void PixelCounter::add(EventSpan events) {
  for (const Event& event : events) {
    ++events_;
    if (!light_.flickers()) {
      count(event);
      continue;
    }
    if (!first_) first_ = event.t;
    const double time = to_seconds(event.t - *first_) * light_.frequency_hz, phase = time - std::floor(time);
    if (const auto period = static_cast<std::int64_t>(time); period > periods_) {
      for (const Event& e : pending_) count(e);
      pending_.clear();
      periods_ = period;
    }
    pending_.push_back(event);
    ++by_phase_[std::min(kParts - 1, static_cast<std::size_t>(phase * kParts))];
    add_phases(event, time);
  }
}

void PixelCounter::add_phases(const Event& event, double periods) {
  for (std::size_t k = 0; k < kDivisors.size(); ++k) {
    phases_[k][event.polarity > 0 ? 0 : 1] +=
        std::polar(1.0, 2 * std::numbers::pi * std::fmod(periods / kDivisors[k], 1));
  }
}

/// Mean resultant length of the phases of each polarity, for one of kDivisors: 1 if all are alike, 0 if they are
/// uniform.
double PixelCounter::clarity(std::size_t divisor) const {
  const auto& [on, off] = phases_[divisor];
  return (std::abs(on) + std::abs(off)) / static_cast<double>(events_);
}

std::string PixelCounter::problem() const {
  if (std::isnan(light_.lux)) return "the illuminance is unknown";
  if (light_.flickers()) return problem_of_lamp();
  if (off_ >= kFewestOff) return "";
  return fmt::format("{} OFF events, which only noise makes; at least {} are necessary: record longer", off_,
                     kFewestOff);
}

std::string PixelCounter::problem_of_lamp() const {
  if (std::isnan(light_.modulation)) return "the modulation of the lamp is unknown";
  const std::uint64_t events = on_ + off_;
  if (events < kFewestEvents || periods_ < kFewestPeriods)
    return fmt::format("{} events in {} periods; at least {} in {} are necessary: record longer", events, periods_,
                       kFewestEvents, kFewestPeriods);
  if (on_ == 0 || off_ == 0)
    return fmt::format("no {} events; turn off the filters of the camera", on_ == 0 ? "ON" : "OFF");
  for (std::size_t k = 1; k < kDivisors.size(); ++k) {
    if (clarity(k) > std::max(kClearPhase, clarity(0))) {
      return fmt::format(
          "the events repeat {:.6g} times per second, or less often, not {:.6g} times; state the "
          "frequency of the lamp",
          light_.frequency_hz / kDivisors[k], light_.frequency_hz);
    }
  }
  if (clarity(0) < kClearPhase)
    return fmt::format(
        "the events do not follow a lamp of {:.6g} Hz: constant light, another frequency, another clock, or an "
        "anti-flicker filter in the camera",
        light_.frequency_hz);
  return "";
}

PixelCounts PixelCounter::finish(double duration_s) const {
  PixelCounts result{light_, pixels_, light_.flickers() ? static_cast<double>(periods_) : duration_s, 0, problem()};
  if (light_.flickers() && periods_ > 0) {
    const auto most = static_cast<double>(*std::max_element(by_phase_.begin(), by_phase_.end()));
    result.peak_hz = most * kParts * light_.frequency_hz / static_cast<double>(periods_);
  } else if (!light_.flickers() && duration_s > 0) {
    result.peak_hz = static_cast<double>(events_) / duration_s;
  }
  return result;
}

}  // namespace esim::inline fit
