#include "esim/formats/events_reader.h"

#include <algorithm>
#include <exception>
#include <utility>

#include "esim/core/error.h"

namespace esim::inline formats {
namespace {

class EventsSource final : public Source {
 public:
  EventsSource(std::unique_ptr<EventsReader> reader, const ReadOptions& options) : reader_(std::move(reader)) {
    const SensorSize sensor = options.sensor.value_or(reader_->sensor());
    CameraInfo& camera = info_.cameras.emplace_back();
    camera.name = "cam0";
    camera.model.width = sensor.width, camera.model.height = sensor.height;
    camera.has_labels = reader_->has_labels();
    // If the file does not state the start, the first portion determines it.
    read();
    waiting_ = true;
    const std::optional<TimeNs> start = reader_->start();
    info_.start_known = start.has_value();
    info_.start = start.value_or(0);
    if (!events_.empty()) info_.start = std::min(start.value_or(events_.front().t), events_.front().t);
    info_.end = std::max(info_.start, reader_->end().value_or(info_.start));
  }

  const RecordingInfo& info() const override { return info_; }
  double progress() const override { return reader_->progress(); }

  const Record* next() override {
    if (!std::exchange(waiting_, false)) read();
    if (!events_.empty()) return &record_.emplace(EventsRecord{0, events_, labels_});
    if (damage_) std::rethrow_exception(std::exchange(damage_, nullptr));
    return nullptr;
  }

 private:
  void read() {
    events_.clear();
    labels_.clear();
    if (ended_) return;
    const auto up_to_damage = [&](const auto& step) {
      try {
        step();
      } catch (const UserError&) {
        if (!damage_) damage_ = std::current_exception();
        ended_ = true;
      }
    };
    up_to_damage([&] {
      while (events_.empty() && !ended_) ended_ = !reader_->read(events_);
    });
    if (!info_.cameras[0].has_labels) return;
    up_to_damage([&] { reader_->read_labels(labels_); });
    if (labels_.size() < events_.size()) ended_ = true;  // events without labels are left out
    events_.resize(std::min(events_.size(), labels_.size()));
  }

  std::unique_ptr<EventsReader> reader_;
  RecordingInfo info_;
  std::vector<Event> events_;
  std::vector<EventLabel> labels_;
  std::optional<Record> record_;
  bool waiting_ = false;  // a portion has been read but not handed out
  bool ended_ = false;
  std::exception_ptr damage_;
};

}  // namespace

std::unique_ptr<Source> make_events_source(std::unique_ptr<EventsReader> reader, const ReadOptions& options) {
  return std::make_unique<EventsSource>(std::move(reader), options);
}

}  // namespace esim::inline formats
