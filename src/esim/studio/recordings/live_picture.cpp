#include "esim/studio/recordings/live_picture.h"

#include "esim/plot/theme.h"
#include "esim/preview/pictures.h"
#include "esim/visualise/event_pictures.h"

namespace esim::studio {
namespace {

constexpr TimeNs kShown = 33 * kNsPerMs;

}  // namespace

void LivePicture::begin(const RecordingInfo& info) {
  const std::lock_guard lock(mutex_);
  width_ = info.cameras.front().model.width, height_ = info.cameras.front().model.height;
  now_ = info.start;
}

void LivePicture::take(const Record& record) {
  if (const auto* const events = std::get_if<EventsRecord>(&record)) {
    if (events->camera != 0 || events->events.empty()) return;
    const std::lock_guard lock(mutex_);
    now_ = events->events.back().t;
    window_.forget_until(now_ - kShown);
    window_.add(events->events);
  } else if (const auto* const truth = std::get_if<TruthRecord>(&record)) {
    if (truth->camera != 0 || truth->irradiance.empty()) return;
    const std::lock_guard lock(mutex_);
    image_ = truth->irradiance;
  }
}

std::string LivePicture::png() const {
  Image<float> image;
  std::vector<Event> events;
  int width = 0, height = 0;
  {
    const std::lock_guard lock(mutex_);
    width = width_, height = height_;
    image = image_;
    for (const Event& event : window_.events()) {
      if (event.t > now_ - kShown) events.push_back(event);
    }
  }
  if (width == 0) return "";
  const EventCounts counts = count_events(events, picture_grid({width, height}, width, height));
  if (image.width() == width && image.height() == height)
    return encode_png(render_events(counts.on, counts.off, dimmed(grey(image))));
  return encode_png(render_events(counts.on, counts.off, Image<Rgb>(width, height, kDarkTheme.ground)));
}

}  // namespace esim::studio
