#include "esim/sampling/frame_sampler.h"

#include <algorithm>
#include <cmath>

namespace esim {
namespace {

class FrameSampler final : public Sampler {
 public:
  FrameSampler(const SamplingOptions& options, const SensorTraits& sensor, int width, int height, const TimeSpan& span,
               const Workers& workers)
      : options_(options),
        sensor_(sensor),
        image_{0, 0, width, height},
        span_(span),
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
    if (current_.t >= span_.end) {
      request_.reset();
      return;
    }
    const TimeNs t = std::visit([this](const auto& criterion) { return next_time(criterion); }, options_);
    request_->t = std::clamp(t, current_.t + 1, span_.end);
  }

  // The k-th time is computed from k, so that rounding does not accumulate.
  TimeNs next_time(const UniformSampling& uniform) {
    return span_.start + to_ns(static_cast<double>(statistics_.samples) / uniform.rate_hz);
  }

  template <typename Adaptive>
  TimeNs next_time(const Adaptive& criterion) {
    const TimeNs shortest = std::max<TimeNs>(1, to_ns(1.0 / criterion.bounds.max_rate_hz));
    const TimeNs longest = std::max(shortest, to_ns(1.0 / criterion.bounds.min_rate_hz));
    const double wanted_s = wanted_interval_s(criterion, sensor_, current_, workers_);
    // Rounded down, so that the criterion's bound holds to the nanosecond.
    const auto wanted = static_cast<TimeNs>(std::min(wanted_s * 1e9, static_cast<double>(longest)));
    if (wanted < shortest) ++statistics_.held_to_max_rate;
    return current_.t + std::max(wanted, shortest);
  }

  SamplingOptions options_;
  SensorTraits sensor_;
  Tile image_;
  TimeSpan span_;
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
