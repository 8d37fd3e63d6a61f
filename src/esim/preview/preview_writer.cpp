#include "esim/preview/preview_writer.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <optional>
#include <vector>

#include "esim/files/output_file.h"
#include "esim/preview/panels.h"
#include "esim/preview/pictures.h"
#include "esim/preview/scales.h"
#include "esim/preview/video_file.h"

namespace esim::inline preview {
namespace {

constexpr double kMinDuration_s = 2.0;
constexpr double kMaxFrames_hz = 60.0;
constexpr double kMinFrames_hz = 4.0;
constexpr std::size_t kMaxCandidates = 12;

/// Candidates for preview.png: every stride-th frame; the stride doubles, so that their number stays small.
class Candidates {
 public:
  bool wants_next() const { return seen_ % stride_ == 0; }

  void skip() { ++seen_; }

  void add(std::uint64_t events, Image<Rgb> image) {
    kept_.push_back({seen_++, events, std::move(image)});
    if (kept_.size() <= kMaxCandidates) return;
    stride_ *= 2;
    std::erase_if(kept_, [this](const Candidate& candidate) { return candidate.frame % stride_ != 0; });
  }

  /// The candidate with the median number of events in the second half; nothing if there was no frame.
  const Image<Rgb>* best() const {
    std::vector<const Candidate*> later;
    for (const Candidate& candidate : kept_) {
      if (2 * candidate.frame >= seen_ - 1) later.push_back(&candidate);
    }
    if (later.empty()) return kept_.empty() ? nullptr : &kept_.back().image;
    const auto middle = later.begin() + static_cast<std::ptrdiff_t>(later.size() / 2);
    std::nth_element(later.begin(), middle, later.end(), [](const Candidate* a, const Candidate* b) {
      return std::pair(a->events, a->frame) < std::pair(b->events, b->frame);
    });
    return &(*middle)->image;
  }

 private:
  struct Candidate {
    std::uint64_t frame = 0, events = 0;
    Image<Rgb> image;
  };
  std::uint64_t seen_ = 0, stride_ = 1;
  std::vector<Candidate> kept_;
};

}  // namespace

Playback choose_playback(double duration_s, double truth_rate_hz) {
  Playback playback;
  if (!(truth_rate_hz > 0)) return playback;
  const auto enough = [&](int slowdown) {
    return duration_s * slowdown >= kMinDuration_s && truth_rate_hz / slowdown <= kMaxFrames_hz;
  };
  constexpr int kMaxSlowdown = 1'000'000;
  for (int decade = 1; decade < kMaxSlowdown; decade *= 10) {
    for (const int slowdown : {decade, 2 * decade, 5 * decade}) {
      const bool too_jerky = slowdown > 1 && truth_rate_hz / slowdown < kMinFrames_hz;
      if (too_jerky) return playback;
      playback = {truth_rate_hz / slowdown, slowdown};
      if (enough(slowdown)) return playback;
    }
  }
  return playback;
}

struct PreviewWriter::Impl {
  Impl(std::filesystem::path in, int index) : folder(std::move(in)), camera(index) {}

  void count(EventSpan events);
  void add_frame(const TruthRecord& truth);
  void add_frame(const ImageRecord& image);
  void show(PreviewFrame frame);

  std::filesystem::path folder;
  int camera;
  Playback playback;
  std::string caption;
  std::optional<PreviewPage> page;
  std::optional<VideoFile> video;

  // Events since the previous frame.
  Image<float> on, off;
  std::uint64_t events = 0;
  std::optional<TimeNs> previous;

  DepthScale depth_scale;
  MotionScale motion_scale;
  Candidates candidates;
};

void PreviewWriter::Impl::count(EventSpan span) {
  for (const Event& event : span) {
    assert(event.x < on.width() && event.y < on.height());
    ++(event.polarity > 0 ? on : off)(event.x, event.y);
  }
  events += span.size();
}

void PreviewWriter::Impl::add_frame(const TruthRecord& truth) {
  depth_scale.include(truth.depth);
  motion_scale.include(truth.motion_x, truth.motion_y);
  show({.t = truth.t,
        .on_events = on,
        .off_events = off,
        .irradiance = truth.irradiance,
        .depth_m = &truth.depth,
        .motion_x_px_per_s = &truth.motion_x,
        .motion_y_px_per_s = &truth.motion_y,
        .near_m = depth_scale.near_m(),
        .far_m = depth_scale.far_m(),
        .full_speed_px_per_s = motion_scale.full_px_per_s()});
}

void PreviewWriter::Impl::add_frame(const ImageRecord& image) {
  show({.t = image.t, .on_events = on, .off_events = off, .irradiance = image.irradiance});
}

void PreviewWriter::Impl::show(PreviewFrame frame) {
  constexpr int kPanels = 3, kPanelsOfImages = 2;
  if (!page) page.emplace(PreviewLayout(on.width(), on.height(), frame.depth_m != nullptr ? kPanels : kPanelsOfImages));
  frame.since_previous = previous ? frame.t - *previous : 0;
  frame.caption = caption;
  Image<Rgb> image = page->compose(frame);
  if (!video) {
    const bool mp4 = can_write(VideoKind::mp4);
    video.emplace(folder / (mp4 ? "preview.mp4" : "preview.webp"), image.width(), image.height(), playback.frames_per_s,
                  mp4 ? VideoKind::mp4 : VideoKind::webp);
  }
  video->append(image);
  if (candidates.wants_next()) {
    candidates.add(events, std::move(image));
  } else {
    candidates.skip();
  }
  on.fill(0);
  off.fill(0);
  events = 0;
  previous = frame.t;
}

PreviewWriter::PreviewWriter(std::filesystem::path folder, int camera)
    : impl_(std::make_unique<Impl>(std::move(folder), camera)) {}

PreviewWriter::~PreviewWriter() = default;

void PreviewWriter::begin(const RecordingInfo& info) {
  const CameraInfo& camera = info.cameras.at(static_cast<std::size_t>(impl_->camera));
  const int width = camera.model.width, height = camera.model.height;
  impl_->on = impl_->off = Image<float>(width, height);
  impl_->playback = choose_playback(to_seconds(info.end - info.start), info.truth_rate_hz);
  impl_->caption = fmt::format("{}  {} x {} px", camera.name, width, height);
  if (impl_->playback.slowdown > 1) {
    impl_->caption += fmt::format("   video {} times slower than real time", impl_->playback.slowdown);
  }
}

void PreviewWriter::write(const Record& record) {
  if (const auto* events = std::get_if<EventsRecord>(&record)) {
    if (events->camera == impl_->camera) impl_->count(events->events);
  } else if (const auto* truth = std::get_if<TruthRecord>(&record)) {
    if (truth->camera == impl_->camera) impl_->add_frame(*truth);
  } else if (const auto* image = std::get_if<ImageRecord>(&record)) {
    if (image->camera == impl_->camera) impl_->add_frame(*image);
  }
}

void PreviewWriter::end(bool) {
  if (!impl_->video) return;
  if (const Image<Rgb>* image = impl_->candidates.best()) {
    OutputFile file(impl_->folder / "preview.png");
    file.append(encode_png(*image));
    file.close();
  }
  impl_->video->close();
  impl_->video.reset();
}

}  // namespace esim::inline preview
