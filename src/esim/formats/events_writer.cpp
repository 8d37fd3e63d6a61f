#include "esim/formats/events_writer.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "esim/core/error.h"
#include "esim/core/remedy.h"
#include "esim/files/number_text.h"
#include "esim/formats/formats.h"

namespace esim::inline formats {
namespace {

std::string seconds(TimeNs t) {
  std::string text;
  append_seconds(text, t);
  return text;
}

class EventsSink final : public Sink {
 public:
  EventsSink(std::unique_ptr<EventsWriter> writer, std::filesystem::path path, const Format& format)
      : writer_(std::move(writer)), path_(std::move(path)), format_(format) {}

  void begin(const RecordingInfo& info) override {
    const Camera& camera = info.cameras.at(0).model;
    if (camera.width > format_.max_width || camera.height > format_.max_height) {
      fail_limits(fmt::format("the sensor has {} x {} px, but format {} holds at most {} x {} px", camera.width,
                              camera.height, format_.name, format_.max_width, format_.max_height));
    }
    if (info.cameras[0].has_labels) writer_->expect_labels();
    const bool known = camera.width > 0 && camera.height > 0;
    width_ = known ? camera.width : format_.max_width;
    height_ = known ? camera.height : format_.max_height;
    writer_->begin(path_, known ? SensorSize{camera.width, camera.height} : SensorSize{});
    open_ = true;
  }

  void write(const Record& record) override {
    const auto* events = std::get_if<EventsRecord>(&record);
    if (events == nullptr || events->camera != 0 || events->events.empty()) return;
    check(events->events);
    writer_->write(events->events);
    if (!events->labels.empty()) writer_->write_labels(events->labels);
    count_ += events->events.size();
  }

  void end(bool) override {
    if (std::exchange(open_, false)) writer_->end();
  }

 private:
  /// Events are in order of time, so checking the first and the last is enough.
  void check(EventSpan events) const {
    int x = 0, y = 0;
    for (const Event& event : events) x = std::max<int>(x, event.x), y = std::max<int>(y, event.y);
    if (events.front().t < format_.min_time || events.back().t > format_.max_time) fail_time(events);
    if (x >= width_ || y >= height_) fail_place(events);
  }

  [[noreturn]] void fail_time(EventSpan events) const {
    const auto fits = [&](const Event& event) { return event.t >= format_.min_time && event.t <= format_.max_time; };
    const auto wrong = std::find_if_not(events.begin(), events.end(), fits);
    fail_limits(fmt::format("event {} is at {} s, but format {} holds times from {} to {} s", index_of(wrong, events),
                            seconds(wrong->t), format_.name, seconds(format_.min_time), seconds(format_.max_time)));
  }

  [[noreturn]] void fail_place(EventSpan events) const {
    const auto fits = [&](const Event& event) { return event.x < width_ && event.y < height_; };
    const auto wrong = std::find_if_not(events.begin(), events.end(), fits);
    const std::string where =
        fmt::format("event {} is at ({}, {}), outside", index_of(wrong, events), wrong->x, wrong->y);
    if (wrong->x >= format_.max_width || wrong->y >= format_.max_height) {
      fail_limits(fmt::format("{} the {} x {} px that format {} can hold", where, format_.max_width, format_.max_height,
                              format_.name));
    }
    fail(fmt::format("{} the sensor of {} x {} px: give the true size of the sensor", where, width_, height_));
  }

  std::uint64_t index_of(EventSpan::iterator event, EventSpan events) const {
    return count_ + static_cast<std::uint64_t>(event - events.begin());
  }

  [[noreturn]] void fail_limits(const std::string& what) const {
    fail(what + "; choose another format, such as dsec or text");
  }

  [[noreturn]] void fail(const std::string& what) const {
    throw UserError(fmt::format("cannot write {}: {}", path_.string(), what));
  }

  std::unique_ptr<EventsWriter> writer_;
  std::filesystem::path path_;
  const Format& format_;
  int width_ = 0, height_ = 0;
  std::uint64_t count_ = 0;
  bool open_ = false;
};

}  // namespace

void require_size(const std::filesystem::path& path, SensorSize sensor) {
  if (sensor.width > 0 && sensor.height > 0) return;
  throw RemediableError(fmt::format("cannot write {}: the format counts pixels from another corner of the sensor, so "
                                    "that the size of the sensor must be known; state it",
                                    path.string()),
                        Remedy::sensor_size);
}

std::unique_ptr<Sink> make_events_sink(std::unique_ptr<EventsWriter> writer, std::filesystem::path path,
                                       std::string_view format) {
  return std::make_unique<EventsSink>(std::move(writer), std::move(path), format_named(format));
}

}  // namespace esim::inline formats
