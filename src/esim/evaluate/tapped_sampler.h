#pragma once

#include <functional>
#include <memory>

#include "esim/sampling/sampler.h"

namespace esim::inline evaluate {

/// One step of a sampler: a sample and the segments that it completes.
struct Tapped {
  TimeNs t = 0;                        ///< time of the accepted sample
  std::int64_t samples = 0;            ///< 1; 0 for further segments of the previous sample
  std::int64_t pixel_evaluations = 0;  ///< cost of the sample
  std::span<const Segment> segments;   ///< completed by the sample
};

/// Forwards to another sampler, and reports every step to a listener.
class TappedSampler final : public Sampler {
 public:
  using Listener = std::function<void(const Tapped&)>;

  TappedSampler(std::unique_ptr<Sampler> sampler, Listener listener)
      : sampler_(std::move(sampler)), listener_(std::move(listener)) {}

  const SampleRequest* next() const override { return sampler_->next(); }
  TimeNs watermark() const override { return sampler_->watermark(); }
  SamplingStatistics statistics() const override { return sampler_->statistics(); }

  std::span<const Segment> accept(Sample& sample) override {
    const TimeNs t = sample.t;
    const std::int64_t before = sampler_->statistics().pixel_evaluations;
    const std::span<const Segment> segments = sampler_->accept(sample);
    listener_({t, 1, sampler_->statistics().pixel_evaluations - before, segments});
    t_ = t;
    return segments;
  }

  std::span<const Segment> more() override {
    const std::span<const Segment> segments = sampler_->more();
    if (!segments.empty()) listener_({t_, 0, 0, segments});
    return segments;
  }

 private:
  std::unique_ptr<Sampler> sampler_;
  Listener listener_;
  TimeNs t_ = 0;  // of the last accepted sample
};

}  // namespace esim::inline evaluate
