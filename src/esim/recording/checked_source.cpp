#include "esim/recording/checked_source.h"

#include <fmt/format.h>

#include <limits>
#include <utility>

#include "esim/core/error.h"
#include "esim/files/number_text.h"

namespace esim::inline recording {
namespace {

constexpr int kMaxExtent = 65536;                                    // px
constexpr TimeNs kMaxTime = std::numeric_limits<TimeNs>::max() / 2;  // differences of times stay representable

}  // namespace

CheckedSource::CheckedSource(std::unique_ptr<Source> inner, std::filesystem::path path, ReadOptions options)
    : inner_(std::move(inner)),
      path_(std::move(path)),
      options_(std::move(options)),
      streams_(inner_->info().cameras.size()) {}

const Record* CheckedSource::next() {
  if (ended_) return nullptr;
  try {
    if (rest_) fail(rest_->events.front(), rest_->camera);
    const Record* record = inner_->next();
    if (record == nullptr) return nullptr;
    const auto* events = std::get_if<EventsRecord>(record);
    return events != nullptr ? checked(*events) : record;
  } catch (const UserError& error) {
    ended_ = true;
    if (!options_.recover) throw;
    options_.recover(error.what());
    return nullptr;
  }
}

/// The events before the first invalid one.
const Record* CheckedSource::checked(const EventsRecord& record) {
  const auto index = static_cast<std::size_t>(record.camera);
  const Camera& camera = info().cameras.at(index).model;
  const int width = camera.width > 0 ? camera.width : kMaxExtent,
            height = camera.height > 0 ? camera.height : kMaxExtent;
  Stream& stream = streams_[index];
  TimeNs last = stream.last.value_or(-kMaxTime);
  std::size_t good = 0;
  for (const Event& event : record.events) {
    if (event.x >= width || event.y >= height || event.t < last || event.t > kMaxTime) break;
    last = event.t;
    ++good;
  }
  if (good > 0) stream.last = last;
  stream.count += good;
  const EventSpan rest = record.events.subspan(good);
  if (!rest.empty()) rest_ = EventsRecord{record.camera, rest, {}};
  if (!rest.empty() && good == 0) fail(rest.front(), record.camera);
  return &part_.emplace(record.part(0, good));
}

void CheckedSource::fail(const Event& event, int camera) const {
  const Stream& stream = streams_[static_cast<std::size_t>(camera)];
  const Camera& model = info().cameras[static_cast<std::size_t>(camera)].model;
  if (event.t > kMaxTime || event.t < -kMaxTime) {
    throw UserError(fmt::format("{}: event {}: the time must be within 4.6e9 s of 0, not {:.3g} s", path_.string(),
                                stream.count, to_seconds(event.t)));
  }
  if (stream.last && event.t < *stream.last) {
    std::string at, before;
    append_seconds(at, event.t);
    append_seconds(before, *stream.last);
    throw UserError(fmt::format("{}: event {} at {} s is before event {} at {} s: sort the events by time",
                                path_.string(), stream.count, at, stream.count - 1, before));
  }
  throw UserError(fmt::format("{}: event {} at ({}, {}) is outside the sensor of {} x {} px", path_.string(),
                              stream.count, event.x, event.y, model.width, model.height));
}

}  // namespace esim::inline recording
