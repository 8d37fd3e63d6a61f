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
    const std::optional<TimeNs> start = reader_->start();
    info_.start_known = start.has_value();
    std::optional<TimeNs> first;
    if (!events_.empty()) first = events_.front().t;
    if (!triggers_.empty()) first = std::min(first.value_or(triggers_.front().t), triggers_.front().t);
    info_.start = start.value_or(first.value_or(0));
    if (first) info_.start = std::min(info_.start, *first);
    info_.end = std::max(info_.start, reader_->end().value_or(info_.start));
  }

  const RecordingInfo& info() const override { return info_; }
  std::vector<std::string> not_read() const override { return reader_->not_read(); }
  double progress() const override { return reader_->progress(); }

  const Record* next() override {
    if (!waiting_ && next_trigger_ == triggers_.size()) read();
    if (std::exchange(waiting_, false)) return &record_.emplace(EventsRecord{0, events_, labels_});
    if (next_trigger_ < triggers_.size()) return &record_.emplace(triggers_[next_trigger_++]);
    if (damage_) std::rethrow_exception(std::exchange(damage_, nullptr));
    return nullptr;
  }

 private:
  void read() {
    read_portion();
    waiting_ = !events_.empty();
  }

  void read_portion() {
    events_.clear();
    labels_.clear();
    triggers_.clear();
    next_trigger_ = 0;
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
      while (events_.empty() && triggers_.empty() && !ended_) {
        ended_ = !reader_->read(events_);
        reader_->read_triggers(triggers_);
      }
    });
    if (damage_) reader_->read_triggers(triggers_);
    if (!info_.cameras[0].has_labels) return;
    up_to_damage([&] { reader_->read_labels(labels_); });
    if (labels_.size() < events_.size()) ended_ = true;  // events without labels are left out
    events_.resize(std::min(events_.size(), labels_.size()));
  }

  std::unique_ptr<EventsReader> reader_;
  RecordingInfo info_;
  std::vector<Event> events_;
  std::vector<EventLabel> labels_;
  std::vector<TriggerRecord> triggers_;
  std::size_t next_trigger_ = 0;
  std::optional<Record> record_;
  bool waiting_ = false;  // events have been read but not handed out
  bool ended_ = false;
  std::exception_ptr damage_;
};

}  // namespace

std::unique_ptr<Source> make_events_source(std::unique_ptr<EventsReader> reader, const ReadOptions& options) {
  return std::make_unique<EventsSource>(std::move(reader), options);
}

}  // namespace esim::inline formats
