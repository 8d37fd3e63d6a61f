#include "esim/studio/recordings/sensor_previews.h"

#include <algorithm>

#include "esim/studio/server/http.h"

namespace esim::studio {
namespace {

constexpr std::size_t kMaxSensors = 4;

[[noreturn]] void refuse() { throw HttpError(404, "this sensor has been replaced by a later change"); }

}  // namespace

std::vector<Event> ChangedSensor::events(TimeNs from, TimeNs to) {
  const std::lock_guard lock(mutex_);
  std::vector<Event> events = preview_.events(from, to, [this] { return !stopped_; });
  if (stopped_) refuse();
  return events;
}

std::string SensorPreviews::add(SensorPreviewOptions options, const std::string& replaced) {
  {  // The replaced sensor stops first, so that it takes no time from the new one.
    const std::lock_guard lock(mutex_);
    std::erase_if(entries_, [&](const Entry& entry) {
      const bool ends = entry.id == replaced;
      if (ends) entry.sensor->stop();
      return ends;
    });
  }
  auto sensor = std::make_shared<ChangedSensor>(std::move(options));
  const std::lock_guard lock(mutex_);
  if (entries_.size() >= kMaxSensors) {
    entries_.front().sensor->stop();
    entries_.pop_front();
  }
  return entries_.emplace_back(Entry{std::to_string(++last_), std::move(sensor)}).id;
}

std::shared_ptr<ChangedSensor> SensorPreviews::find(const std::string& id) const {
  const std::lock_guard lock(mutex_);
  const auto found = std::ranges::find(entries_, id, &Entry::id);
  if (found == entries_.end()) refuse();
  return found->sensor;
}

}  // namespace esim::studio
