#include "esim/formats/hdf5/event_columns.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "esim/core/error.h"
#include "esim/formats/hdf5/event_blocks.h"
#include "esim/formats/hdf5/input.h"

namespace esim::inline formats {
namespace {

constexpr int kLargestExtent = 65536;  // px
constexpr double kLatestSeconds = 4e9;
constexpr std::int64_t kLatestUs = 4'000'000'000'000'000;

constexpr EventColumns kE2calib = {"t", "x", "y", "p"};
constexpr EventColumns kE2vid = {"events/ts", "events/xs", "events/ys", "events/ps"};

bool holds_reals(const hdf5::Column& column) {
  const hdf5::Handle type(H5Dget_type(column.dataset), H5Tclose);
  return H5Tget_class(type) == H5T_FLOAT;
}

class ColumnsReader final : public EventBlocksReader {
 public:
  ColumnsReader(const EventColumns& names, const std::filesystem::path& path)
      : file_(path),
        t_(file_.open_items(names.t, 0)),
        x_(file_.open_items(names.x, 0)),
        y_(file_.open_items(names.y, 0)),
        p_(file_.open_items(names.p, 0)),
        in_seconds_(holds_reals(t_)) {
    if (x_.size != t_.size || y_.size != t_.size || p_.size != t_.size) {
      file_.fail(std::string(names.t) + " and the other datasets of the events differ in length");
    }
    if (names.resolution != nullptr && file_.has(names.resolution)) read_resolution(names.resolution);
    if (names.ms_index != nullptr && file_.has(names.ms_index))
      milliseconds_ = static_cast<std::int64_t>(file_.open_column(names.ms_index).size);
  }

  SensorSize sensor() const override { return sensor_; }

  std::optional<TimeNs> start() const override { return milliseconds_ > 0 ? std::optional<TimeNs>(0) : std::nullopt; }
  std::optional<TimeNs> end() const override {
    constexpr std::int64_t kLatestMs = kLatestUs / 1000;
    const TimeNs index_end = std::clamp<std::int64_t>(milliseconds_ - 1, 0, kLatestMs) * kNsPerMs;
    if (t_.size == 0) return start() ? std::optional(index_end) : std::nullopt;
    const TimeNs last = times(t_.size - 1, 1).front();
    return start() ? std::max(last, index_end) : last;
  }

 private:
  std::uint64_t event_count() const override { return t_.size; }

  void read_block(std::uint64_t first, std::uint64_t count, std::vector<Event>& events) override {
    const std::vector<TimeNs> t = times(first, count);
    x_numbers_.resize(count), y_numbers_.resize(count), p_numbers_.resize(count);
    file_.read(x_, first, std::span(x_numbers_));
    file_.read(y_, first, std::span(y_numbers_));
    file_.read(p_, first, std::span(p_numbers_));
    for (std::size_t i = 0; i < count; ++i) {
      const std::int64_t x = x_numbers_[i], y = y_numbers_[i];
      if (x < 0 || x >= kLargestExtent || y < 0 || y >= kLargestExtent) {
        file_.fail("event " + std::to_string(first + i) + " at (" + std::to_string(x) + ", " + std::to_string(y) +
                   ") is out of range");
      }
      events.push_back({t[i], static_cast<std::uint16_t>(x), static_cast<std::uint16_t>(y),
                        static_cast<std::int8_t>(p_numbers_[i] > 0 ? 1 : -1)});
    }
  }

  std::vector<TimeNs> times(std::uint64_t first, std::uint64_t count) const {
    std::vector<TimeNs> t(count);
    if (in_seconds_) {
      std::vector<double> seconds(count);
      file_.read(t_, first, std::span(seconds));
      for (std::size_t i = 0; i < count; ++i) {
        if (!(std::abs(seconds[i]) <= kLatestSeconds)) fail_time(first + i);
        t[i] = to_ns(seconds[i]);
      }
    } else {
      file_.read(t_, first, std::span(t));
      for (std::size_t i = 0; i < count; ++i) {
        if (t[i] > kLatestUs || t[i] < -kLatestUs) fail_time(first + i);
        t[i] *= kNsPerUs;
      }
    }
    return t;
  }

  [[noreturn]] void fail_time(std::uint64_t index) const {
    file_.fail("the time of event " + std::to_string(index) + " is out of range");
  }

  void read_resolution(const char* name) {
    const hdf5::Column column = file_.open_column(name);
    std::int64_t size[2] = {};
    if (column.size != 2) file_.fail(std::string(name) + " must hold two numbers, width and height");
    file_.read(column, 0, std::span<std::int64_t>(size));
    for (const std::int64_t extent : size) {
      if (extent < 1 || extent > kLargestExtent)
        file_.fail(std::string(name) + " must be from 1 to 65536 px, not " + std::to_string(extent) + " px");
    }
    sensor_ = {static_cast<int>(size[0]), static_cast<int>(size[1])};
  }

  hdf5::Input file_;
  hdf5::Column t_, x_, y_, p_;
  bool in_seconds_;
  SensorSize sensor_;
  std::int64_t milliseconds_ = 0;  // number of entries of the index; 0: no index
  std::vector<std::int64_t> x_numbers_, y_numbers_, p_numbers_;
};

Format read_only(const char* name, const char* description, const EventColumns& names) {
  return {
      .name = name,
      .description = description,
      .holds = {Content::events},
      .recognises = [names](const auto& path, std::string_view head) { return has_event_columns(names, path, head); },
      .open = [names](const auto& path,
                      const ReadOptions& options) { return open_event_columns(names, path, options); },
  };
}

}  // namespace

bool is_hdf5(std::string_view head) { return head.starts_with("\x89HDF\r\n\x1a\n"); }

bool has_event_columns(const EventColumns& names, const std::filesystem::path& path, std::string_view head) {
  if (!is_hdf5(head)) return false;
  try {
    const hdf5::Input file(path);
    const char* all[] = {names.t, names.x, names.y, names.p};
    return std::all_of(std::begin(all), std::end(all), [&](const char* name) { return file.has(name); });
  } catch (const UserError&) {  // DSEC's reader, which takes all other files, reports the problem
    return false;
  }
}

std::unique_ptr<Source> open_event_columns(const EventColumns& names, const std::filesystem::path& path,
                                           const ReadOptions& options) {
  return make_events_source(std::make_unique<ColumnsReader>(names, path), options);
}

Format e2calib_format() { return read_only("e2calib", "HDF5 with x, y, p and t, the input of e2calib", kE2calib); }

Format e2vid_format() { return read_only("e2vid", "HDF5 with events/xs, ys, ps and ts, used with E2VID", kE2vid); }

}  // namespace esim::inline formats
