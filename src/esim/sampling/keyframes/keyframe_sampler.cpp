#include "esim/sampling/keyframes/keyframe_sampler.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>
#include <utility>
#include <vector>

#include "esim/core/error.h"
#include "esim/core/fast_log.h"
#include "esim/core/random.h"
#include "esim/reproject/disagreement.h"
#include "esim/reproject/reprojector.h"
#include "esim/sampling/keyframes/supersampling.h"

namespace esim::inline sampling {
namespace {

constexpr double kMaxPerSecond = 50000;  // maximum rate of reconstructions, whatever the motion
constexpr double kMaxUnseen = 0.01;      // maximum fraction of pixels hidden from both keyframes, except at edges

// The first of every kAuditEvery intervals between keyframes is compared with the truth.
constexpr std::int64_t kAuditEvery = 6;

/// A keyframe, and the speed of its image.
struct MovingKeyframe {
  Keyframe keyframe;
  double typical_px_per_s = 0;  ///< 99 % of the pixels are slower
  double fastest_px_per_s = 0;  ///< 99.9 %
  std::int64_t unseen = 0;      ///< sensor pixels hidden even in the keyframe's own view, at edges

  TimeNs t() const { return keyframe.view.t; }
};

/// Two quantiles of the pixels' speed, px/s. Speeds that are not finite do not count.
std::pair<double, double> speeds(const Sample& sample, double lower_share, double upper_share) {
  std::vector<float> squared;
  squared.reserve(sample.motion_x.size());
  for (std::size_t i = 0; i < sample.motion_x.size(); ++i) {
    const float vx = sample.motion_x.pixels()[i], vy = sample.motion_y.pixels()[i], v2 = vx * vx + vy * vy;
    if (std::isfinite(v2)) squared.push_back(v2);
  }
  if (squared.empty()) return {0, 0};
  const auto at = [&](double share) {
    const auto rank = static_cast<std::ptrdiff_t>(share * static_cast<double>(squared.size() - 1));
    std::nth_element(squared.begin(), squared.begin() + rank, squared.end());
    return std::sqrt(double{squared[static_cast<std::size_t>(rank)]});
  };
  return {at(lower_share), at(upper_share)};
}

class KeyframeSampler final : public Sampler {
 public:
  KeyframeSampler(const KeyframeSampling& options, const SamplingContext& context, const SceneAccess& scene)
      : options_(options),
        context_(context),
        view_at_(scene.view_at),
        setup_(set_up_keyframes(options, context, scene)),
        reprojector_(setup_.layout, scene.renderer.traits().at_infinity, context.workers, setup_.parts),
        random_(0, Purpose::sampling_audit),
        watermark_(context.span.start) {
    statistics_.tolerance = options.tolerance;
    request(context.span.start);
  }

  const SampleRequest* next() const override { return unsettled_ || step_ > 0 || !request_ ? nullptr : &*request_; }

  std::span<const Segment> accept(Sample& sample) override {
    const bool first = statistics_.samples == 0, audit = request_->renderer == nullptr;
    ++statistics_.samples;
    for (const Tile& tile : sample.tiles) statistics_.pixel_evaluations += static_cast<std::int64_t>(tile.area());
    if (audit) {
      std::swap(truth_, sample);
      ++statistics_.audits;
      return reconstruct();
    }
    take(sample);
    if (!first) return settle();
    before_ = std::move(ahead_.back());
    ahead_.pop_back();
    reprojector_.reconstruct(before_.keyframe, before_.keyframe, view_at_(before_.t()), Detail::whole, later_);
    ++reconstructions_;
    segment_ = {sensor(), before_.t(), before_.t(), &later_.irradiance, &later_.irradiance};
    if (before_.t() < context_.span.end) {
      request(predicted());
    } else {
      request_.reset();
    }
    return {&segment_, 1};
  }

  std::span<const Segment> more() override {
    if (unsettled_) {
      unsettled_ = false;
      return settle();
    }
    return step_ > 0 ? reconstruct() : std::span<const Segment>{};
  }

  TimeNs watermark() const override { return watermark_; }

  SamplingStatistics statistics() const override {
    SamplingStatistics result = statistics_;
    if (statistics_.audits > 0) result.measured_error = measured_error(errors_);
    const double pixels = static_cast<double>(sensor().area()) * static_cast<double>(reconstructions_);
    result.others = {{"supersampling", std::int64_t{layout().supersampling}},
                     {"resampling_error", setup_.resampling_error},
                     {"reconstructions", reconstructions_},
                     {"unseen_fraction", pixels > 0 ? static_cast<double>(unseen_) / pixels : 0.0}};
    return result;
  }

  void save(StateWriter& archive) const override {
    transfer(archive, *this);
    transfer_keyframe(archive, before_);
    archive.objects(ahead_, transfer_keyframe<StateWriter, const MovingKeyframe>);
    const bool of_sensor = request_ && request_->renderer == nullptr;
    archive.value(of_sensor);
    archive.value(request_ ? request_->t : kEnded);
  }
  /// Renders the keyframes that are still needed again.
  void restore(StateReader& archive) override {
    truth_.resize(sensor().width, sensor().height);
    transfer(archive, *this);
    transfer_keyframe(archive, before_);
    archive.objects(ahead_, transfer_keyframe<StateReader, MovingKeyframe>);
    bool of_sensor = false;
    TimeNs t = 0;
    archive.value(of_sensor);
    archive.value(t);
    if (statistics_.samples > 0) render_again(before_.keyframe);
    for (MovingKeyframe& ahead : ahead_) render_again(ahead.keyframe);
    if (t == kEnded) {
      request_.reset();
    } else if (of_sensor) {
      request_ = SampleRequest{t, {sensor()}};
    } else {
      request(t);
    }
  }

 private:
  static constexpr TimeNs kEnded = std::numeric_limits<TimeNs>::max();

  /// All that differs between two samples, except the keyframes and the request.
  template <class Archive, class Self>
  static void transfer(Archive& archive, Self& self) {
    archive.value(self.step_);
    archive.value(self.steps_);
    archive.value(self.intervals_);
    archive.value(self.truth_.t);
    archive.sized_image(self.truth_.irradiance);
    archive.sized_image(self.later_.irradiance);
    archive.value(self.watermark_);
    archive.value(self.unsettled_);
    transfer_statistics(archive, self.statistics_);
    archive.value(self.errors_);
    archive.value(self.reconstructions_);
    archive.value(self.unseen_);
  }

  template <class Archive, class Self>
  static void transfer_keyframe(Archive& archive, Self& self) {
    archive.value(self.keyframe.view.t);
    archive.value(self.typical_px_per_s);
    archive.value(self.fastest_px_per_s);
    archive.value(self.unseen);
  }

  /// Renders a keyframe of which only the time is known.
  void render_again(Keyframe& keyframe) {
    const RenderRequest view = view_at_(keyframe.view.t);
    RenderRequest whole = view;
    whole.tiles = {{0, 0, layout().camera.width, layout().camera.height}};
    Sample sample;
    setup_.renderer->render(std::move(whole), sample);
    reprojector_.prepare(view, sample, setup_.renderer->take_light(sample), keyframe);
  }

  const KeyframeLayout& layout() const { return setup_.layout; }
  Tile sensor() const { return {0, 0, layout().sensor.width, layout().sensor.height}; }

  void request(TimeNs t) {
    request_ = SampleRequest{t, {{0, 0, layout().camera.width, layout().camera.height}}, setup_.renderer.get()};
  }

  /// Adds a rendered keyframe as the next of those ahead.
  void take(Sample& sample) {
    MovingKeyframe& taken = ahead_.emplace_back();
    std::tie(taken.typical_px_per_s, taken.fastest_px_per_s) = speeds(sample, 0.99, 0.999);
    taken.typical_px_per_s /= layout().supersampling;
    taken.fastest_px_per_s /= layout().supersampling;
    const RenderRequest view = view_at_(sample.t);
    reprojector_.prepare(view, sample, setup_.renderer->take_light(sample), taken.keyframe);
    reprojector_.reconstruct(taken.keyframe, taken.keyframe, view, Detail::apart, apart_);
    taken.unseen = apart_.unseen;
  }

  TimeNs shortest() const { return std::max<TimeNs>(1, to_ns(1.0 / options_.bounds.max_rate_hz)); }

  /// Time of the keyframe after `before_`.
  TimeNs predicted() {
    const TimeNs longest = std::max(shortest(), to_ns(1.0 / options_.bounds.min_rate_hz));
    const double wanted_ns = 1e9 * options_.max_displacement_px / before_.typical_px_per_s;
    const auto wanted = static_cast<TimeNs>(std::min(wanted_ns, static_cast<double>(longest)));
    if (wanted < shortest()) ++statistics_.held_to_max_rate;
    return std::min(before_.t() + std::max(wanted, shortest()), context_.span.end);
  }

  /// Starts the interval up to the next keyframe, or requests another keyframe in its middle.
  std::span<const Segment> settle() {
    const TimeNs interval = ahead_.back().t() - before_.t();
    if (!agree()) {
      if (interval / 2 >= shortest()) {
        ++statistics_.bisections;
        request(before_.t() + interval / 2);
        return {};
      }
      ++statistics_.held_to_max_rate;
    }
    const double fastest = std::max(before_.fastest_px_per_s, ahead_.back().fastest_px_per_s);
    const double steps = std::ceil(to_seconds(interval) * std::min(fastest / options_.lambda, kMaxPerSecond));
    steps_ = static_cast<TimeNs>(std::clamp(steps, 1.0, static_cast<double>(interval)));
    step_ = 0;
    if (intervals_++ % kAuditEvery == 0 && interval > 1) {
      const auto [share, unused] = random_.uniforms(0, static_cast<std::uint64_t>(intervals_));
      const TimeNs t = before_.t() + 1 + static_cast<TimeNs>(share * static_cast<double>(interval - 1));
      request_ = SampleRequest{t, {sensor()}};
      return {};
    }
    return reconstruct();
  }

  /// Whether the keyframes around an interval are close enough.
  bool agree() {
    const MovingKeyframe& after = ahead_.back();
    const TimeNs interval = after.t() - before_.t();
    const double moved = to_seconds(interval) * std::max(before_.typical_px_per_s, after.typical_px_per_s);
    double worst = 0;
    std::int64_t unseen = 0;
    for (const int quarter : {1, 2, 3}) {
      const TimeNs t = before_.t() + interval / 4 * quarter;
      reprojector_.reconstruct(before_.keyframe, after.keyframe, view_at_(t), Detail::apart, apart_);
      worst = std::max(worst, disagreement(apart_, context_.sensor.log_eps));
      unseen = std::max(unseen, apart_.unseen);
    }
    return worst <= options_.tolerance * context_.sensor.contrast_threshold &&
           static_cast<double>(unseen - std::max(before_.unseen, after.unseen)) <=
               kMaxUnseen * static_cast<double>(sensor().area()) &&
           moved <= 2 * options_.max_displacement_px;
  }

  /// The next of the `steps_` segments; after the last one, the interval's later keyframe becomes the earlier one.
  std::span<const Segment> reconstruct() {
    ++step_;
    const MovingKeyframe& after = ahead_.back();
    const double share = static_cast<double>(step_) / static_cast<double>(steps_);
    const TimeNs t = step_ == steps_
                         ? after.t()
                         : before_.t() + static_cast<TimeNs>(share * static_cast<double>(after.t() - before_.t()));
    std::swap(earlier_, later_);
    reprojector_.reconstruct(before_.keyframe, after.keyframe, view_at_(t), Detail::whole, later_);
    ++reconstructions_;
    unseen_ += later_.unseen;
    segment_ = {sensor(), watermark_, t, &earlier_.irradiance, &later_.irradiance};
    if (watermark_ < truth_.t && truth_.t <= t) audit();
    watermark_ = t;
    if (step_ == steps_) advance();
    return {&segment_, 1};
  }

  /// Compares the segment with the truth, weighted by the length of its interval.
  void audit() {
    const auto eps = static_cast<float>(context_.sensor.log_eps);
    const auto share = static_cast<float>(to_seconds(truth_.t - segment_.t0) / to_seconds(segment_.t1 - segment_.t0));
    const double weight = to_seconds(ahead_.back().t() - before_.t());
    const auto earlier = earlier_.irradiance.pixels(), later = later_.irradiance.pixels();
    const auto truth = truth_.irradiance.pixels();
    for (std::size_t i = 0; i < truth.size(); ++i) {
      const float told = (1 - share) * fast_log(earlier[i] + eps) + share * fast_log(later[i] + eps);
      errors_.add(std::fabs(told - fast_log(truth[i] + eps)), weight);
    }
  }

  void advance() {
    step_ = steps_ = 0;
    before_ = std::move(ahead_.back());
    ahead_.pop_back();
    if (!ahead_.empty()) {
      unsettled_ = true;
    } else if (before_.t() < context_.span.end) {
      request(predicted());
    } else {
      request_.reset();
    }
  }

  KeyframeSampling options_;
  SamplingContext context_;
  std::function<RenderRequest(TimeNs)> view_at_;
  KeyframeSetup setup_;
  Reprojector reprojector_;

  std::optional<SampleRequest> request_;
  MovingKeyframe before_;              // segments are complete up to this keyframe
  std::vector<MovingKeyframe> ahead_;  // later keyframes, the last one is the next
  TimeNs step_ = 0, steps_ = 0;        // of the current interval: done and total; otherwise 0
  std::int64_t intervals_ = 0;         // started so far
  Sample truth_;                       // of the latest audit
  AddressedRandom random_;
  Reconstruction earlier_, later_, apart_;
  Segment segment_;
  TimeNs watermark_;
  bool unsettled_ = false;

  SamplingStatistics statistics_;
  LogHistogram errors_;
  std::int64_t reconstructions_ = 0;  // images between keyframes
  std::int64_t unseen_ = 0;           // their pixels that no keyframe sees
};

}  // namespace

std::unique_ptr<Sampler> make_keyframe_sampler(const KeyframeSampling& options, const SamplingContext& context,
                                               const SceneAccess* scene) {
  if (scene == nullptr)
    throw UserError("sampling: type keyframes needs a scene that other cameras can see; use type flow or brightness");
  if (const RendererTraits traits = scene->renderer.traits(); traits.on_sensor) {
    throw UserError("sampling: type keyframes is not supported where " + traits.name +
                    " are drawn on the sensor itself; use type flow or brightness");
  }
  if (context.sensor.mosaic) {
    throw UserError(
        "sampling: keyframes interpolates between neighbouring pixels, which see different colours; use adaptive or "
        "flow, or colour: none");
  }
  return std::make_unique<KeyframeSampler>(options, context, *scene);
}

}  // namespace esim::inline sampling
