#pragma once

#include <atomic>
#include <list>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "esim/compose/samples/sensor_preview.h"

namespace esim::studio {

/// An event sensor of a recording with changed options, whose events are made on request. Thread-safe.
class ChangedSensor {
 public:
  explicit ChangedSensor(SensorPreviewOptions options) : preview_(std::move(options)) {}

  const SensorPreview& preview() const { return preview_; }

  /// As of SensorPreview. Throws HttpError 404 if the sensor is stopped.
  std::vector<Event> events(TimeNs from, TimeNs to);

  /// Ends a request that is being answered, and all later ones.
  void stop() { stopped_ = true; }

 private:
  std::atomic<bool> stopped_{false};
  std::mutex mutex_;
  SensorPreview preview_;
};

/// The latest sensors that have been changed.
class SensorPreviews {
 public:
  /// Adds a sensor, which replaces another one (empty: none), and returns its id. Throws UserError.
  std::string add(SensorPreviewOptions options, const std::string& replaced);

  /// Throws HttpError 404 if it has been replaced.
  std::shared_ptr<ChangedSensor> find(const std::string& id) const;

 private:
  struct Entry {
    std::string id;
    std::shared_ptr<ChangedSensor> sensor;
  };
  mutable std::mutex mutex_;
  std::list<Entry> entries_;  // the oldest first
  int last_ = 0;
};

}  // namespace esim::studio
