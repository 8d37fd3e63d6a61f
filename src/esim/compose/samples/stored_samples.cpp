#include "esim/compose/samples/stored_samples.h"

#include <algorithm>
#include <set>
#include <utility>
#include <vector>

namespace esim::inline compose {
namespace {

class NoRenderer final : public ProcessorRenderer {
 public:
  RendererTraits traits() const override { return {.name = "stored samples", .at_infinity = true, .has_edges = false}; }

 private:
  void compute(std::span<const RenderRequest>, Sample&) const override {}
};

/// The tiles of a sampler are ahead of each other by its longest interval, which is usually shorter.
constexpr TimeNs kMostAhead = kNsPerSecond / 4;

/// Requests a sample of nothing for each group of portions of a store. Few large groups are faster than many small
/// ones.
class StoredSampler final : public Sampler {
 public:
  StoredSampler(SampleStoreReader store, TimeNs begin, const Workers& workers)
      : store_(std::move(store)), workers_(workers), begin_(begin), watermark_(store_.info().start) {
    if (begin > store_.info().start) store_.seek(begin - kMostAhead);
    read_group();
  }

  const SampleRequest* next() const override { return has_group_ && !handed_out_ ? &request_ : nullptr; }

  std::span<const Segment> accept(Sample&) override {
    watermark_ = std::max(watermark_, group_watermark_);
    handed_out_ = !segments_.empty();
    if (!handed_out_) read_group();
    return handed_out_ ? segments_ : std::span<const Segment>{};
  }

  std::span<const Segment> more() override {
    if (std::exchange(handed_out_, false)) read_group();
    return {};
  }

  TimeNs watermark() const override { return watermark_; }
  SamplingStatistics statistics() const override { return {}; }

 private:
  void read_group() {
    segments_.clear();
    has_group_ = false;
    do {
      const SampleStoreReader::Portion* const portion = store_.next(workers_);
      if (portion == nullptr) break;
      for (const Segment& segment : portion->segments) add(segment);
      group_watermark_ = portion->watermark;
      has_group_ = true;
    } while (store_.has_more());
    if (!has_group_) watermark_ = store_.info().end;
    // Event cameras take the segments of a tile one after the other.
    std::ranges::stable_sort(segments_, {}, [](const Segment& s) { return std::pair(s.tile.y, s.tile.x); });
    request_.t = std::clamp(group_watermark_, watermark_, store_.info().end);
    request_.tiles = {{0, 0, 1, 1}};
  }

  void add(const Segment& segment) {
    if (begin_ > store_.info().start) {
      if (segment.t1 <= begin_) return;
      const bool is_first = begun_.emplace(segment.tile.x, segment.tile.y).second;
      if (is_first && segment.t0 != segment.t1)
        segments_.push_back({segment.tile, segment.t0, segment.t0, segment.irradiance0, segment.irradiance0});
    }
    segments_.push_back(segment);
  }

  SampleStoreReader store_;
  const Workers& workers_;
  TimeNs begin_;
  std::set<std::pair<int, int>> begun_;  // tiles, if it begins later than the store
  std::vector<Segment> segments_;        // of the group
  TimeNs group_watermark_ = 0;
  bool has_group_ = false;
  bool handed_out_ = false;  // its segments are in use
  SampleRequest request_;
  TimeNs watermark_;
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

std::unique_ptr<Sampler> make_stored_sampler(SampleStoreReader store, const Workers& workers,
                                             std::optional<TimeNs> begin) {
  const TimeNs start = store.info().start;
  return std::make_unique<StoredSampler>(std::move(store), begin.value_or(start), workers);
}

}  // namespace esim::inline compose
