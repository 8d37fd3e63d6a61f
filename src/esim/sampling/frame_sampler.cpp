#include "esim/sampling/frame_sampler.h"

#include <algorithm>
#include <cmath>

namespace esim {
namespace {

/// Shortest and longest interval between two samples, ns.
struct IntervalBounds {
  TimeNs shortest, longest;
};

IntervalBounds interval_bounds(const UniformSampling& options) {
  const TimeNs interval = std::max<TimeNs>(1, to_ns(1.0 / options.rate_hz));
  return {interval, interval};
}

template <typename Adaptive>
IntervalBounds interval_bounds(const Adaptive& options) {
  const TimeNs shortest = std::max<TimeNs>(1, to_ns(1.0 / options.bounds.max_rate_hz));
  return {shortest, std::max(shortest, to_ns(1.0 / options.bounds.min_rate_hz))};
}

class FrameSampler final : public Sampler {
 public:
  FrameSampler(const SamplingOptions& options, const SensorTraits& sensor, int width, int height, const TimeSpan& span,
               const Workers& workers)
      : options_(options),
        sensor_(sensor),
        bounds_(std::visit([](const auto& criterion) { return interval_bounds(criterion); }, options)),
        image_{0, 0, width, height},
        end_(span.end),
        workers_(workers),
        request_(SampleRequest{span.start, {image_}}),
        watermark_(span.start) {}

  std::optional<SampleRequest> next() const override { return request_; }

  std::span<const Segment> accept(Sample& sample) override {
    const bool first = statistics_.samples == 0;
    std::swap(previous_, current_);
    std::swap(current_, sample);
    const Image<float>& before = first ? current_.irradiance : previous_.irradiance;
    segment_ = {image_, first ? current_.t : previous_.t, current_.t, &before, &current_.irradiance};

    ++statistics_.samples;
    statistics_.pixel_evaluations += static_cast<std::int64_t>(image_.area());
    watermark_ = current_.t;
    schedule();
    return {&segment_, 1};
  }

  TimeNs watermark() const override { return watermark_; }
  SamplingStatistics statistics() const override { return statistics_; }

 private:
  /// Chooses the time of the next request from the current sample.
  void schedule() {
    if (current_.t >= end_) {
      request_.reset();
      return;
    }
    const double wanted_s = std::visit(
        [&](const auto& criterion) { return wanted_interval_s(criterion, sensor_, current_, workers_); }, options_);
    // Rounded down, so that the criterion's bound holds to the nanosecond.
    const double wanted_ns = std::floor(std::min(wanted_s * 1e9, static_cast<double>(bounds_.longest)));
    const TimeNs interval = std::clamp(static_cast<TimeNs>(wanted_ns), bounds_.shortest, bounds_.longest);
    if (wanted_ns < static_cast<double>(bounds_.shortest)) ++statistics_.held_to_max_rate;
    request_->t = std::min(current_.t + interval, end_);
  }

  SamplingOptions options_;
  SensorTraits sensor_;
  IntervalBounds bounds_;
  Tile image_;
  TimeNs end_;
  const Workers& workers_;

  std::optional<SampleRequest> request_;
  Sample previous_, current_;
  Segment segment_;
  TimeNs watermark_;
  SamplingStatistics statistics_;
};

}  // namespace

std::unique_ptr<Sampler> make_frame_sampler(const SamplingOptions& options, const SensorTraits& sensor, int width,
                                            int height, const TimeSpan& span, const Workers& workers) {
  return std::make_unique<FrameSampler>(options, sensor, width, height, span, workers);
}

}  // namespace esim
