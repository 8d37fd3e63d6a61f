#include "esim/visualise/player.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <limits>

#include "esim/core/error.h"
#include "esim/core/parallel.h"
#include "esim/core/remedy.h"
#include "esim/files/number_text.h"
#include "esim/preview/pictures.h"
#include "esim/visualise/event_pictures.h"
#include "esim/visualise/event_window.h"
#include "esim/visualise/space_time.h"

namespace esim::inline visualise {
namespace {

constexpr double kMaxFrames = 1e6;
constexpr double kMinVideo_s = 3.9;
constexpr double kMinWindow_s = 1e-3, kMaxWindow_s = 50e-3, kEventsPerPixel = 1.0 / 12;
constexpr double kWindowsPerTau = 1.5, kWindowsPerSpan = 20;
constexpr std::size_t kMaxEventsCounted = std::size_t{1} << 23;
constexpr std::size_t kMaxPoints = 160'000;
constexpr std::size_t kMaxEventsWaiting = std::size_t{1} << 22, kMaxPicturesWaiting = 64;

// Rounds up to 1, 2 or 5 times a power of ten, within rounding errors.
double round_up(double value) {
  const double decade = std::pow(10.0, std::floor(std::log10(value)));
  for (const double step : {1.0, 2.0, 5.0}) {
    if (step * decade >= value * (1 - 1e-9)) return step * decade;
  }
  return 10 * decade;
}

std::string milliseconds(double seconds) { return fmt::format("{:.4g} ms", 1e3 * seconds); }

struct Picture {
  TimeNs t = 0;
  Image<Rgb> pixels;
};

/// Images of one kind that wait for their time.
class PictureQueue {
 public:
  void add(TimeNs t, Image<Rgb> pixels) {
    waiting_.push_back({t, std::move(pixels)});
    if (waiting_.size() > kMaxPicturesWaiting) advance();
  }
  const Image<Rgb>& at(TimeNs t) {
    while (!waiting_.empty() && waiting_.front().t <= t) advance();
    return shown_;
  }
  /// The same in another size, scaled once for all frames of the video that show it.
  const Image<Rgb>& enlarged_at(TimeNs t, int width, int height) {
    const Image<Rgb>& picture = at(t);
    if (enlarged_.empty() && !picture.empty()) enlarged_ = enlarge(picture, width, height);
    return enlarged_;
  }

 private:
  void advance() {
    shown_ = std::move(waiting_.front().pixels);
    enlarged_ = {};
    waiting_.pop_front();
  }
  std::deque<Picture> waiting_;
  Image<Rgb> shown_, enlarged_;
};

Image<float> reduced(const Image<float>& image, const PictureGrid& grid) {
  return image.width() > grid.width || image.height() > grid.height
             ? reduce_mean(image, std::min(grid.width, image.width()), std::min(grid.height, image.height()))
             : image;
}
Image<float> picked(const Image<float>& image, const PictureGrid& grid) {
  return reduce_nearest(image, grid.width, grid.height);
}

// Digital numbers without conversion: cameras encode for display.
Image<Rgb> grey(const FrameRecord& frame, const PictureGrid& grid) {
  const float full = static_cast<float>((1u << std::clamp(frame.bits, 1, 16)) - 1);
  Image<float> levels(frame.image.width(), frame.image.height());
  for (std::size_t i = 0; i < levels.size(); ++i) levels.pixels()[i] = frame.image.pixels()[i] / full;
  const Image<float> small = reduced(levels, grid);
  Image<Rgb> out(small.width(), small.height());
  std::transform(small.pixels().begin(), small.pixels().end(), out.pixels().begin(), [](float level) {
    return mix({}, {255, 255, 255}, std::clamp(level, 0.0f, 1.0f));
  });
  return out;
}

// Frames of a camera are preferred to images of a video, and these to ground truth.
std::optional<Content> image_content(const RecordingOverview& overview) {
  for (const Content content : {Content::frames, Content::images, Content::truth}) {
    if (overview.last.contains(content)) return content;
  }
  return std::nullopt;
}

}  // namespace

PlayOptions choose_missing(PlayOptions options, const RecordingOverview& overview) {
  if (overview.events == 0) {
    throw UserError(fmt::format("{}: there are no events between {} and {} s", options.name,
                                to_seconds(overview.start - overview.origin),
                                to_seconds(overview.end - overview.origin)));
  }
  const std::vector<View> all = views_of(overview);
  if (options.views.empty()) options.views = all;
  for (const View view : options.views) {
    if (std::find(all.begin(), all.end(), view) == all.end())
      throw UserError(fmt::format("{} has nothing to show as {}", options.name, name_of(view)));
  }
  const double duration_s = to_seconds(overview.end - overview.start);
  if (options.slow_motion <= 0) {
    options.slow_motion = duration_s > 0 ? round_up(std::max(1.0, std::min(kMinVideo_s / duration_s, 1e6))) : 1;
  }
  if (options.window_s <= 0) {
    const double pixels = static_cast<double>(overview.sensor.width) * overview.sensor.height;
    const double rate_hz = static_cast<double>(overview.events) / std::max(duration_s, 1e-9);
    options.window_s = round_up(std::clamp(kEventsPerPixel * pixels / rate_hz, kMinWindow_s, kMaxWindow_s));
  }
  if (options.tau_s <= 0) options.tau_s = kWindowsPerTau * options.window_s;
  if (options.span_s <= 0) options.span_s = kWindowsPerSpan * options.window_s;
  return options;
}

Instants video_instants(const RecordingOverview& overview, const PlayOptions& options) {
  const double step_ns = 1e9 / (options.frames_per_s * options.slow_motion);
  const double steps = static_cast<double>(overview.end - overview.start) / step_ns;
  if (!(steps < kMaxFrames)) {
    throw RemediableError(fmt::format("{} lasts {:.4g} s, too long for a video; choose a part of it, or show it faster",
                                      options.name, to_seconds(overview.end - overview.start)),
                          Remedy::shorter_video);
  }
  return {overview.start, step_ns, static_cast<std::size_t>(std::ceil(steps - 1e-6)) + 1};
}

struct Player::Impl {
  Impl(Source& from, int which, const RecordingOverview& about, const PlayOptions& how, const Instants& when)
      : source(from),
        camera(which),
        overview(about),
        options(how),
        instants(when),
        layout(how.views, about.sensor, how.width),
        grid(picture_grid(about.sensor, layout.panel_width, layout.panel_height)),
        image_from(image_content(about)),
        window(how.window_events > 0 ? how.window_events : kMaxEventsCounted),
        cloud(kMaxPoints, true),
        surface(grid) {}

  bool shows(View view) const {
    return std::find(options.views.begin(), options.views.end(), view) != options.views.end();
  }
  bool shows_irradiance() const { return image_from == Content::images || image_from == Content::truth; }
  TimeNs known_until() const;
  bool read();
  TimeNs advance();
  void add_image(TimeNs t, Image<Rgb> picture);
  void add(const TruthRecord& truth);
  void pass_events(TimeNs until);
  Panel draw(View view, TimeNs t);
  std::vector<Panel> draw_all(TimeNs t);
  Panel draw_events(TimeNs t);
  Panel draw_cloud(TimeNs t);

  Source& source;
  int camera;
  RecordingOverview overview;
  PlayOptions options;
  Instants instants;
  PageLayout layout;
  PictureGrid grid;
  std::optional<Content> image_from;
  Workers workers{0};

  bool ended = false;
  std::size_t shown = 0;
  std::map<Content, TimeNs> seen;
  std::deque<Event> waiting;
  EventWindow window, cloud;
  TimeSurface surface;
  PictureQueue images, backgrounds, depths, motions;
};

// Time until which all records are known; kinds of records that have ended do not count.
TimeNs Player::Impl::known_until() const {
  TimeNs until = std::numeric_limits<TimeNs>::max();
  if (ended || waiting.size() > kMaxEventsWaiting) return until;
  for (const auto& [content, last] : overview.last) {
    const auto now = seen.find(content);
    if (now == seen.end()) return std::numeric_limits<TimeNs>::min();
    // Further records with the same time may follow.
    if (now->second < last) until = std::min(until, now->second - 1);
  }
  return until;
}

bool Player::Impl::read() {
  const Record* record = source.next();
  if (record == nullptr) {
    ended = true;
    return false;
  }
  const auto stamp = stamp_of(*record);
  if (!stamp || stamp->camera != camera) return true;
  seen[content_of(*record)] = stamp->last;
  if (const auto* events = std::get_if<EventsRecord>(record)) {
    waiting.insert(waiting.end(), events->events.begin(), events->events.end());
  } else if (const auto* truth = std::get_if<TruthRecord>(record)) {
    add(*truth);
  } else if (const auto* image = std::get_if<ImageRecord>(record); image != nullptr && shows_irradiance()) {
    add_image(image->t, esim::grey(reduced(image->irradiance, grid)));
  } else if (const auto* frame = std::get_if<FrameRecord>(record); frame != nullptr && image_from == Content::frames) {
    add_image(frame->t, grey(*frame, grid));
  }
  return true;
}

void Player::Impl::add_image(TimeNs t, Image<Rgb> picture) {
  if (shows(View::events)) backgrounds.add(t, dimmed(picture));
  if (shows(View::image)) images.add(t, std::move(picture));
}

void Player::Impl::add(const TruthRecord& truth) {
  if (shows_irradiance() && !truth.irradiance.empty()) {
    add_image(truth.t, esim::grey(reduced(truth.irradiance, grid)));
  }
  if (shows(View::depth))
    depths.add(truth.t, colour_depth(picked(truth.depth, grid), overview.depth.near_m(), overview.depth.far_m()));
  if (shows(View::motion)) {
    motions.add(truth.t, colour_motion(picked(truth.motion_x, grid), picked(truth.motion_y, grid),
                                       overview.motion.full_px_per_s()));
  }
}

// Adds the events up to this time to the views.
void Player::Impl::pass_events(TimeNs until) {
  constexpr std::size_t kPortion = 4096;
  std::vector<Event> portion;
  while (!waiting.empty() && waiting.front().t <= until) {
    portion.clear();
    while (portion.size() < kPortion && !waiting.empty() && waiting.front().t <= until) {
      portion.push_back(waiting.front());
      waiting.pop_front();
    }
    if (options.window_events == 0) window.forget_until(portion.back().t - to_ns(options.window_s));
    window.add(portion);
    surface.add(portion);
    if (shows(View::space_time)) {
      cloud.forget_until(portion.back().t - to_ns(options.span_s));
      cloud.add(portion);
    }
  }
}

Panel Player::Impl::draw_events(TimeNs t) {
  if (options.window_events == 0) window.forget_until(t - to_ns(options.window_s));
  const EventSpan events = window.events();
  const EventCounts counts = count_events(events, grid);
  Image<Rgb> background = backgrounds.at(t);
  if (background.width() != grid.width || background.height() != grid.height)
    background = Image<Rgb>(grid.width, grid.height, options.theme.ground);
  const std::string span = options.window_events == 0 ? milliseconds(options.window_s)
                           : events.empty()           ? ""
                                                      : milliseconds(to_seconds(t - events.front().t));
  return {.picture = render_events(counts.on, counts.off, std::move(background)),
          .note = fmt::format("{} in {}", grouped(events.size()), span),
          .polarities = true};
}

Panel Player::Impl::draw_cloud(TimeNs t) {
  cloud.forget_until(t - to_ns(options.span_s));
  const SpaceTimeBox box{overview.sensor, t - std::max<TimeNs>(1, to_ns(options.span_s)), t, overview.origin};
  const double share = instants.count > 1 ? static_cast<double>(shown) / static_cast<double>(instants.count) : 0.25;
  std::string note = milliseconds(options.span_s);
  if (cloud.stride() > 1) note += fmt::format(", 1 of {} events", cloud.stride());
  return {.picture = draw_space_time(cloud.events(), box, turned_view(share), layout.panel_width, layout.panel_height,
                                     options.theme),
          .note = note,
          .polarities = true};
}

Panel Player::Impl::draw(View view, TimeNs t) {
  const auto large = [&](PictureQueue& queue) { return queue.enlarged_at(t, layout.panel_width, layout.panel_height); };
  switch (view) {
    case View::events:
      return draw_events(t);
    case View::time_surface:
      return {.picture = surface.draw(t, 1e9 * options.tau_s, options.theme.ground),
              .note = "tau " + milliseconds(options.tau_s),
              .polarities = true};
    case View::space_time:
      return draw_cloud(t);
    case View::image:
      return {.picture = large(images)};
    case View::depth:
      return {.picture = large(depths), .near_m = overview.depth.near_m(), .far_m = overview.depth.far_m()};
    case View::motion:
      return {.picture = large(motions), .full_speed_px_per_s = overview.motion.full_px_per_s()};
  }
  return {};
}

// The views share no mutable data while they are drawn.
std::vector<Panel> Player::Impl::draw_all(TimeNs t) {
  std::vector<Panel> panels(options.views.size());
  workers.for_each(static_cast<int>(panels.size()), [&](int i) {
    const auto index = static_cast<std::size_t>(i);
    panels[index] = draw(options.views[index], t);
  });
  return panels;
}

Player::Player(Source& source, int camera, const RecordingOverview& overview, const PlayOptions& options,
               const Instants& instants)
    : impl_(std::make_unique<Impl>(source, camera, overview, options, instants)) {}

Player::~Player() = default;

const PageLayout& Player::layout() const { return impl_->layout; }

// Advances to the next instant.
TimeNs Player::Impl::advance() {
  const TimeNs t = instants.at(shown);
  while (known_until() < t && read()) {
  }
  pass_events(t);
  return t;
}

std::optional<Image<Rgb>> Player::next() {
  if (impl_->shown == impl_->instants.count) return std::nullopt;
  const TimeNs t = impl_->advance();
  std::vector<Panel> panels = impl_->draw_all(t);
  ++impl_->shown;
  const SensorSize sensor = impl_->overview.sensor;
  std::string about = fmt::format("{}   {} x {} px", impl_->options.name, sensor.width, sensor.height);
  if (impl_->options.slow_motion != 1 && impl_->instants.count > 1)
    about += fmt::format("   1/{:g} of real time", impl_->options.slow_motion);
  return draw_page(impl_->layout, panels, fmt::format("t = {:.4f} s", to_seconds(t - impl_->overview.origin)), about,
                   impl_->options.theme);
}

std::optional<Image<Rgb>> Player::next_picture() {
  if (impl_->shown == impl_->instants.count) return std::nullopt;
  const TimeNs t = impl_->advance();
  const Panel panel = impl_->draw(impl_->options.views.front(), t);
  ++impl_->shown;
  const int width = impl_->layout.panel_width, height = impl_->layout.panel_height;
  return panel.picture.empty() ? Image<Rgb>(width, height, impl_->options.theme.ground)
                               : enlarge(panel.picture, width, height);
}

}  // namespace esim::inline visualise
