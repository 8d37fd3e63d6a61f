#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "esim/core/error.h"
#include "esim/formats/hdf5/dsec.h"
#include "esim/formats/hdf5/label_datasets.h"
#include "esim/formats/hdf5/library.h"
#include "esim/formats/hdf5/millisecond_index.h"

namespace esim::inline formats {
namespace {

constexpr std::size_t kChunkEvents = 1 << 16;
constexpr std::size_t kChunkMs = 1 << 10;
constexpr int kNoLimit = std::numeric_limits<int>::max();

std::int64_t floor_divide(std::int64_t value, std::int64_t divisor) {
  const std::int64_t quotient = value / divisor;
  return quotient - (value % divisor < 0 ? 1 : 0);
}

// t_offset in units. If the start is unknown, whole seconds are subtracted, so that the digits after them stay.
std::int64_t offset_of(const RecordingInfo& info, std::int64_t ns_per_unit) {
  if (info.start_known) return floor_divide(info.start, ns_per_unit);
  return floor_divide(info.start, kNsPerSecond) * (kNsPerSecond / ns_per_unit);
}

}  // namespace

struct EventsHdf5Writer::Impl {
  Impl(std::filesystem::path file_path, int camera_index, EventsHdf5Options chosen)
      : path(std::move(file_path)), camera(camera_index), options(chosen) {}
  ~Impl() {
    const hdf5::Quiet quiet;
    close_series();
    file.reset();
  }

  void create(const RecordingInfo& info);
  void append(const EventsRecord& record);
  void check(EventSpan events);
  void store(EventSpan events);
  [[noreturn]] void refuse(const Event& event, const char* reason) const;
  void write_chunk();
  void close_series();

  std::filesystem::path path;
  int camera;
  EventsHdf5Options options;

  std::int64_t ns_per_unit = 1;
  TimeNs origin = 0;  // t_offset in ns
  TimeNs planned_end = 0;
  TimeNs last_seen = 0;  // latest time of any record
  int width = 0, height = 0;
  bool narrow_t = false;  // uint32
  TimeNs last_t = std::numeric_limits<TimeNs>::min();

  // Buffers with `fill` events.
  std::size_t fill = 0;
  std::vector<std::uint32_t> t32;
  std::vector<std::uint64_t> t64;
  std::vector<std::uint16_t> x, y;
  std::vector<std::uint8_t> p;

  // Declared last, so that the series close before the file.
  std::optional<hdf5::Output> file;
  hdf5::Handle esim_complete;
  hdf5::Series t_series, x_series, y_series, p_series;
  hdf5::MillisecondIndex milliseconds;
  std::optional<hdf5::LabelSeries> labels;
};

void EventsHdf5Writer::Impl::create(const RecordingInfo& info) {
  const CameraInfo& model = info.cameras.at(static_cast<std::size_t>(camera));
  width = model.model.width;
  height = model.model.height;
  ns_per_unit = options.unit == TimeUnit::us ? kNsPerUs : 1;
  const std::int64_t t_offset = offset_of(info, ns_per_unit);
  origin = t_offset * ns_per_unit;
  planned_end = info.end;
  last_seen = info.start;
  narrow_t = options.unit == TimeUnit::us && info.end > info.start &&
             floor_divide(info.end, kNsPerUs) - t_offset <= std::numeric_limits<std::uint32_t>::max();

  (narrow_t ? t32.resize(kChunkEvents) : t64.resize(kChunkEvents));
  x.resize(kChunkEvents);
  y.resize(kChunkEvents);
  p.resize(kChunkEvents);

  const hdf5::Quiet quiet;
  file.emplace(path);
  file->create_group("events");
  const auto series = [&](const char* name, hid_t type) {
    return hdf5::Series(*file, name, {type, {}, kChunkEvents, options.compression});
  };
  t_series = series("events/t", narrow_t ? H5T_STD_U32LE : H5T_STD_U64LE);
  x_series = series("events/x", H5T_STD_U16LE);
  y_series = series("events/y", H5T_STD_U16LE);
  p_series = series("events/p", H5T_STD_U8LE);
  if (model.has_labels) labels.emplace(*file, kChunkEvents, options.compression);
  milliseconds.open(hdf5::Series(*file, "ms_to_idx", {H5T_STD_U64LE, {}, kChunkMs, Compression::none}));
  file->create_scalar("t_offset", t_offset);
  file->create_text_attribute(file->id(), "unit", options.unit == TimeUnit::us ? "us" : "ns");
  if (width > 0) file->create_attribute(file->id(), "width", static_cast<std::uint32_t>(width));
  if (height > 0) file->create_attribute(file->id(), "height", static_cast<std::uint32_t>(height));
  esim_complete = file->create_attribute(file->id(), "esim_complete", std::uint8_t{0});
  file->flush();
}

void EventsHdf5Writer::Impl::refuse(const Event& event, const char* reason) const {
  throw InternalError(
      fmt::format("{}: event (t, x, y) = ({} ns, {}, {}) {}", path.string(), event.t, event.x, event.y, reason));
}

/// Throws unless the events are in order and inside the image, and their times fit.
void EventsHdf5Writer::Impl::check(EventSpan events) {
  const int width_limit = width == 0 ? kNoLimit : width, height_limit = height == 0 ? kNoLimit : height;
  const auto is_good = [&](TimeNs before, const Event& event) {
    return static_cast<bool>((event.t >= before) & (event.x < width_limit) & (event.y < height_limit));
  };
  bool good = true;
  TimeNs before = std::max(last_t, origin);
  for (const Event& event : events) {
    good &= is_good(before, event);
    before = event.t;
  }
  if (!good) {
    for (const Event& event : events) {
      if (!is_good(std::max(last_t, origin), event)) refuse(event, "is out of order or outside the image");
      last_t = event.t;
    }
  }
  last_t = before;
  constexpr TimeNs kLongest = TimeNs{std::numeric_limits<std::uint32_t>::max()} * kNsPerUs + kNsPerUs - 1;
  if (narrow_t && last_t - origin > kLongest) refuse(events.back(), "is long after the planned end");
}

/// Adds events, for which there must be room, to the buffers.
void EventsHdf5Writer::Impl::store(EventSpan events) {
  milliseconds.add(events, origin);
  // One loop for each column: a store to one can then not change what the others need.
  const auto fill_column = [&](auto& column, const auto& value_of) {
    std::ranges::transform(events, column.begin() + static_cast<std::ptrdiff_t>(fill), value_of);
  };
  if (narrow_t) {
    fill_column(t32, [start = origin](const Event& event) {
      return static_cast<std::uint32_t>(static_cast<std::uint64_t>(event.t - start) / kNsPerUs);
    });
  } else {
    fill_column(t64, [start = origin, unit = static_cast<std::uint64_t>(ns_per_unit)](const Event& event) {
      return static_cast<std::uint64_t>(event.t - start) / unit;
    });
  }
  fill_column(x, [](const Event& event) { return event.x; });
  fill_column(y, [](const Event& event) { return event.y; });
  fill_column(p, [](const Event& event) { return static_cast<std::uint8_t>(event.polarity > 0); });
  fill += events.size();
}

void EventsHdf5Writer::Impl::append(const EventsRecord& record) {
  if (labels && record.labels.size() != record.events.size())
    throw InternalError(path.string() + ": " + std::to_string(record.labels.size()) + " labels of " +
                        std::to_string(record.events.size()) + " events");
  for (std::size_t first = 0; first < record.events.size();) {
    const EventsRecord part = record.part(first, std::min(record.events.size() - first, kChunkEvents - fill));
    check(part.events);
    store(part.events);
    if (labels) std::ranges::for_each(part.labels, [&](const EventLabel& label) { labels->store(label); });
    if (fill == kChunkEvents) write_chunk();
    first += part.events.size();
  }
  if (!record.events.empty()) last_seen = std::max(last_seen, last_t);
}

void EventsHdf5Writer::Impl::write_chunk() {
  const hdf5::Quiet quiet;
  if (narrow_t) {
    t_series.append(std::span<const std::uint32_t>(t32).first(fill));
  } else {
    t_series.append(std::span<const std::uint64_t>(t64).first(fill));
  }
  x_series.append(std::span<const std::uint16_t>(x).first(fill));
  y_series.append(std::span<const std::uint16_t>(y).first(fill));
  p_series.append(std::span<const std::uint8_t>(p).first(fill));
  fill = 0;
  if (labels) labels->write([&](TimeNs t) { return floor_divide(t - origin, ns_per_unit); });
  milliseconds.write();
  file->flush();
}

void EventsHdf5Writer::Impl::close_series() {
  esim_complete.reset();
  for (hdf5::Series* series : {&t_series, &x_series, &y_series, &p_series}) *series = hdf5::Series();
  labels.reset();
  milliseconds.close();
}

EventsHdf5Writer::EventsHdf5Writer(std::filesystem::path path, int camera, EventsHdf5Options options)
    : impl_(std::make_unique<Impl>(std::move(path), camera, options)) {}

EventsHdf5Writer::~EventsHdf5Writer() = default;

void EventsHdf5Writer::begin(const RecordingInfo& info) { impl_->create(info); }

void EventsHdf5Writer::write(const Record& record) {
  if (const auto* events = std::get_if<EventsRecord>(&record)) {
    if (events->camera == impl_->camera) impl_->append(*events);
  } else if (const auto* truth = std::get_if<TruthRecord>(&record)) {
    impl_->last_seen = std::max(impl_->last_seen, truth->t);
  } else if (const auto* image = std::get_if<ImageRecord>(&record)) {
    impl_->last_seen = std::max(impl_->last_seen, image->t);
  } else if (const auto* pose = std::get_if<PoseRecord>(&record)) {
    impl_->last_seen = std::max(impl_->last_seen, pose->t);
  }
}

void EventsHdf5Writer::end(bool complete) {
  Impl& impl = *impl_;
  if (!impl.file) return;
  const hdf5::Quiet quiet;
  const TimeNs end = complete ? std::max(impl.planned_end, impl.last_seen) : impl.last_seen;
  const TimeNs duration = std::max<TimeNs>(end - impl.origin, 0);
  impl.milliseconds.finish(static_cast<std::uint64_t>(duration / impl.ns_per_unit * impl.ns_per_unit));
  impl.write_chunk();
  if (complete) {
    constexpr std::uint8_t kOne = 1;
    impl.file->check(H5Awrite(impl.esim_complete, H5T_NATIVE_UINT8, &kOne));
  }
  impl.close_series();
  impl.file->close();
  impl.file.reset();
}

}  // namespace esim::inline formats
