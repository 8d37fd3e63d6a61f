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
  void store(const Event& event);
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

void EventsHdf5Writer::Impl::append(const EventsRecord& record) {
  const EventSpan events = record.events;
  if (labels && record.labels.size() != events.size())
    throw InternalError(path.string() + ": " + std::to_string(record.labels.size()) + " labels of " +
                        std::to_string(events.size()) + " events");
  for (std::size_t i = 0; i < events.size(); ++i) {
    const Event& event = events[i];
    const bool inside = (width == 0 || event.x < width) && (height == 0 || event.y < height);
    if (event.t < last_t || event.t < origin || !inside) {
      throw InternalError(path.string() + ": event (t, x, y) = (" + std::to_string(event.t) + " ns, " +
                          std::to_string(event.x) + ", " + std::to_string(event.y) +
                          ") is out of order or outside the image");
    }
    last_t = event.t;
    store(event);
    if (labels) labels->store(record.labels[i]);
    if (fill == kChunkEvents) write_chunk();
  }
  if (!events.empty()) last_seen = std::max(last_seen, events.back().t);
}

void EventsHdf5Writer::Impl::store(const Event& event) {
  const auto since_origin = static_cast<std::uint64_t>(event.t - origin);
  milliseconds.add(since_origin);
  if (narrow_t) {
    const std::uint64_t t_us = since_origin / kNsPerUs;
    if (t_us > std::numeric_limits<std::uint32_t>::max()) {
      throw InternalError(path.string() + ": event at " + std::to_string(event.t) + " ns, long after the planned end");
    }
    t32[fill] = static_cast<std::uint32_t>(t_us);
  } else {
    t64[fill] = options.unit == TimeUnit::us ? since_origin / kNsPerUs : since_origin;
  }
  x[fill] = event.x;
  y[fill] = event.y;
  p[fill] = event.polarity > 0 ? 1 : 0;
  ++fill;
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
