#pragma once

#include <algorithm>
#include <filesystem>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "esim/recording/compression.h"
#include "esim/recording/source.h"

namespace esim::inline recording {

/// Width and height of a sensor, px.
struct SensorSize {
  int width = 0, height = 0;
};

struct ReadOptions {
  std::optional<SensorSize> sensor{};  ///< replaces the sensor size in the file

  /// If set, damaged or truncated files are read as far as possible, and this is called with the problem.
  std::function<void(const std::string& problem)> recover{};
};

enum class TimeUnit { us, ns };

struct WriteOptions {
  TimeUnit unit = TimeUnit::us;  ///< unit of event times, if the format allows a choice
  Compression compression = Compression::blosc;
};

/// Kinds of record, and parts of records that not every format can hold.
enum class Content { events, event_labels, frames, images, imu, poses, truth, optical_flow, event_points, triggers };

/// A format: its name, its functions and its limits. One file in `formats/` describes each; `formats/formats.cpp` lists
/// them.
struct Format {
  std::string name{};                     ///< as in `--format`: "evt3"
  std::string description{};              ///< one line of text
  std::vector<std::string> extensions{};  ///< ".raw"; the first format that has a path's extension writes it
  std::vector<Content> holds{};
  bool several_cameras = false;                          ///< false: only camera 0
  bool folder = false;                                   ///< true: a recording is a folder; false: a file
  TimeNs resolution = 1;                                 ///< ns; event times are rounded down to multiples of it
  bool either_unit = false;                              ///< and to multiples of WriteOptions::unit
  int max_width = 65536, max_height = 65536;             ///< px; maximum size of the sensor
  TimeNs min_time = std::numeric_limits<TimeNs>::min();  ///< earliest and
  TimeNs max_time = std::numeric_limits<TimeNs>::max();  ///< latest time of events, ns

  /// Whether a path is a file (or folder) of this format, by its content; `head` is its first 4096 bytes, or fewer.
  /// Empty if another format reads its files.
  std::function<bool(const std::filesystem::path& path, std::string_view head)> recognises{};

  /// Throws UserError if the file cannot be opened.
  std::function<std::unique_ptr<Source>(const std::filesystem::path& path, const ReadOptions& options)> open{};

  /// Empty if the format cannot be written. `path` is where to write; an existing file is replaced.
  std::function<std::unique_ptr<Sink>(const std::filesystem::path& path, const WriteOptions& options)> create{};

  bool can_hold(Content content) const { return std::find(holds.begin(), holds.end(), content) != holds.end(); }

  /// The default extension, such as ".raw"; empty for formats without extensions.
  std::string extension() const { return extensions.empty() ? std::string() : extensions.front(); }
};

Content content_of(const Record& record);

/// Plural names for messages: "events", "IMU measurements".
std::string_view describe(Content content);

}  // namespace esim::inline recording
