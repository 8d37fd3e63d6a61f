#include "esim/compose/samples/stored_samples.h"

#include <algorithm>
#include <utility>

namespace esim::inline compose {
namespace {

class NoRenderer final : public ProcessorRenderer {
 public:
  RendererTraits traits() const override { return {.name = "stored samples", .at_infinity = true, .has_edges = false}; }

 private:
  void compute(std::span<const RenderRequest>, Sample&) const override {}
};

/// Requests a sample of nothing for each portion of a store.
class StoredSampler final : public Sampler {
 public:
  StoredSampler(SampleStoreReader store, const Workers& workers) : store_(std::move(store)), workers_(workers) {
    watermark_ = store_.info().start;
    advance();
  }

  const SampleRequest* next() const override { return portion_ != nullptr && !handed_out_ ? &request_ : nullptr; }

  std::span<const Segment> accept(Sample&) override {
    watermark_ = portion_->watermark;
    const std::span<const Segment> segments = portion_->segments;
    handed_out_ = true;
    if (segments.empty()) advance();
    return segments;
  }

  std::span<const Segment> more() override {
    if (handed_out_) advance();
    return {};
  }

  TimeNs watermark() const override { return watermark_; }
  SamplingStatistics statistics() const override { return {}; }

 private:
  void advance() {
    handed_out_ = false;
    portion_ = store_.next(workers_);
    if (portion_ == nullptr) {
      watermark_ = store_.info().end;
      return;
    }
    request_.t = std::clamp(portion_->watermark, watermark_, store_.info().end);
    request_.tiles = {{0, 0, 1, 1}};
  }

  SampleStoreReader store_;
  const Workers& workers_;
  const SampleStoreReader::Portion* portion_ = nullptr;  // the next one; null after the last
  bool handed_out_ = false;                              // its segments are in use
  SampleRequest request_;
  TimeNs watermark_ = 0;
};

class NoSampler final : public Sampler {
 public:
  explicit NoSampler(TimeNs end) : end_(end) {}

  const SampleRequest* next() const override { return nullptr; }
  std::span<const Segment> accept(Sample&) override { return {}; }
  std::span<const Segment> more() override { return {}; }
  TimeNs watermark() const override { return end_; }
  SamplingStatistics statistics() const override { return {}; }

 private:
  TimeNs end_;
};

}  // namespace

std::unique_ptr<Sampler> make_no_sampler(TimeNs end) { return std::make_unique<NoSampler>(end); }

std::unique_ptr<Renderer> make_no_renderer() { return std::make_unique<NoRenderer>(); }

std::unique_ptr<Sampler> make_stored_sampler(SampleStoreReader store, const Workers& workers) {
  return std::make_unique<StoredSampler>(std::move(store), workers);
}

}  // namespace esim::inline compose
