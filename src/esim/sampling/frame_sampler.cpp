#include "esim/sampling/frame_sampler.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <variant>

namespace esim::inline sampling {
namespace {

struct Criterion {
  WantedInterval wanted_s;
  RateBounds bounds;
};

using Times = std::variant<Criterion, UniformSampling>;

class FrameSampler final : public Sampler {
 public:
  FrameSampler(Times times, const SamplingContext& context)
      : times_(std::move(times)),
        context_(context),
        image_{0, 0, context.width, context.height},
        request_(SampleRequest{context.span.start, {image_}}),
        watermark_(context.span.start) {}

  const SampleRequest* next() const override { return request_ ? &*request_ : nullptr; }

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

  std::span<const Segment> more() override { return {}; }

  TimeNs watermark() const override { return watermark_; }
  SamplingStatistics statistics() const override { return statistics_; }

  void save(StateWriter& archive) const override {
    transfer(archive, *this);
    archive.value(request_ ? request_->t : kEnded);
  }
  void restore(StateReader& archive) override {
    current_.resize(context_.width, context_.height);
    transfer(archive, *this);
    TimeNs t = 0;
    archive.value(t);
    t == kEnded ? request_.reset() : void(request_->t = t);
  }

 private:
  static constexpr TimeNs kEnded = std::numeric_limits<TimeNs>::max();

  /// Of the last sample, only what the next segment and its time need.
  template <class Archive, class Self>
  static void transfer(Archive& archive, Self& self) {
    transfer_statistics(archive, self.statistics_);
    archive.value(self.watermark_);
    archive.value(self.current_.t);
    archive.sized_image(self.current_.irradiance);
  }

  /// Chooses the time of the next request from the current sample.
  void schedule() {
    if (current_.t >= context_.span.end) {
      request_.reset();
      return;
    }
    const TimeNs t = std::visit([this](const auto& times) { return next_time(times); }, times_);
    request_->t = std::clamp(t, current_.t + 1, context_.span.end);
  }

  // The k-th time is computed from k, so that rounding does not accumulate.
  TimeNs next_time(const UniformSampling& uniform) {
    return context_.span.start + to_ns(static_cast<double>(statistics_.samples) / uniform.rate_hz);
  }

  TimeNs next_time(const Criterion& criterion) {
    const TimeNs shortest = std::max<TimeNs>(1, to_ns(1.0 / criterion.bounds.max_rate_hz));
    const TimeNs longest = std::max(shortest, to_ns(1.0 / criterion.bounds.min_rate_hz));
    // Rounded down, so that the criterion's bound holds exactly.
    const auto wanted = static_cast<TimeNs>(std::min(criterion.wanted_s(current_) * 1e9, static_cast<double>(longest)));
    if (wanted < shortest) ++statistics_.held_to_max_rate;
    return current_.t + std::max(wanted, shortest);
  }

  Times times_;
  SamplingContext context_;
  Tile image_;

  std::optional<SampleRequest> request_;
  Sample previous_, current_;
  Segment segment_;
  TimeNs watermark_;
  SamplingStatistics statistics_;
};

}  // namespace

std::unique_ptr<Sampler> make_frame_sampler(const WantedInterval& wanted_s, const RateBounds& bounds,
                                            const SamplingContext& context) {
  return std::make_unique<FrameSampler>(Criterion{wanted_s, bounds}, context);
}

std::unique_ptr<Sampler> make_frame_sampler(const UniformSampling& uniform, const SamplingContext& context) {
  return std::make_unique<FrameSampler>(uniform, context);
}

}  // namespace esim::inline sampling
