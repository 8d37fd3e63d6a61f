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

#include "esim/record/formats/compression.h"
#include "esim/record/source.h"

namespace esim {

/// Width and height of a sensor, px.
struct SensorSize {
  int width = 0, height = 0;
};

struct ReadOptions {
  std::optional<SensorSize> sensor{};  ///< replaces what the file says of its cameras

  /// Where set: what can be read of a file that is cut or damaged is read, and this is told what is wrong with it.
  std::function<void(const std::string& problem)> recover{};
};

enum class TimeUnit { us, ns };

struct WriteOptions {
  TimeUnit unit = TimeUnit::us;  ///< of the times of events, where the format leaves the choice
  Compression compression = Compression::blosc;
};

/// Kinds of record.
enum class Content { events, frames, images, imu, poses, truth, displacement, event_points, triggers };

/// What a format is, and what it can hold. One file in `formats/` describes each; `formats/formats.cpp` lists them.
struct Format {
  std::string name{};                     ///< as in `--format`: "evt3"
  std::string description{};              ///< a line for people
  std::vector<std::string> extensions{};  ///< ".raw"; the first format that has a path's extension writes it
  std::vector<Content> holds{};
  bool several_cameras = false;                          ///< else records of camera 0 are all there is
  bool folder = false;                                   ///< a recording is a folder of files, not a file
  TimeNs resolution = 1;                                 ///< times of events are rounded down to multiples of it, ns
  bool either_unit = false;                              ///< and to multiples of WriteOptions::unit
  int max_width = 65536, max_height = 65536;             ///< px: larger sensors do not fit
  TimeNs min_time = std::numeric_limits<TimeNs>::min();  ///< of events: earlier ones do not fit
  TimeNs max_time = std::numeric_limits<TimeNs>::max();  ///< and neither do later ones

  /// Is it a file (or folder) of this format? By its content, of which `head` is the first 4096 bytes, or less.
  std::function<bool(const std::filesystem::path& path, std::string_view head)> recognises{};

  /// Throws UserError where the file cannot be opened.
  std::function<std::unique_ptr<Source>(const std::filesystem::path& path, const ReadOptions& options)> open{};

  /// Nothing where the format is only read. `path` is where to write; a file there is replaced.
  std::function<std::unique_ptr<Sink>(const std::filesystem::path& path, const WriteOptions& options)> create{};

  bool can_hold(Content content) const { return std::find(holds.begin(), holds.end(), content) != holds.end(); }

  /// The usual one: ".raw"; empty where there is none.
  std::string extension() const { return extensions.empty() ? std::string() : extensions.front(); }
};

/// All formats.
const std::vector<Format>& formats();

/// Throws UserError, with the names that there are, for others.
const Format& format_named(std::string_view name);

/// The format of what is there. Throws UserError for paths that are not there and for unknown content.
const Format& format_of(const std::filesystem::path& path);

/// The format that is written to a path, by its extension; null for unknown ones, of which format_for() throws
/// UserError.
const Format* find_format_for(const std::filesystem::path& path);
const Format& format_for(const std::filesystem::path& path);

/// Opens a file of any format, and holds it to what a Source promises: events that are out of order or outside the
/// sensor, as far as its size is known, are a UserError with index and values.
std::unique_ptr<Source> open_source(const std::filesystem::path& path, const ReadOptions& options = {});

/// Throws UserError where a recording from `path` has no camera, with what of the file cannot be read.
void require_camera(const Source& source, const std::filesystem::path& path);

Content content_of(const Record& record);

/// For people: "events", "measurements of the IMU".
std::string_view describe(Content content);

}  // namespace esim
