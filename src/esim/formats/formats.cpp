#include "esim/formats/formats.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <set>

#include "esim/core/error.h"
#include "esim/files/input_file.h"
#include "esim/files/number_text.h"
#include "esim/formats/aedat4/aedat4.h"
#include "esim/formats/datasets/event_camera_dataset.h"
#include "esim/formats/datasets/nmnist.h"
#include "esim/formats/event_stream/event_stream.h"
#include "esim/formats/hdf5/dsec.h"
#include "esim/formats/hdf5/event_columns.h"
#include "esim/formats/hdf5/m3ed.h"
#include "esim/formats/hdf5/v2e.h"
#include "esim/formats/images/image_sequences.h"
#include "esim/formats/jaer/aedat2.h"
#include "esim/formats/numpy/npy.h"
#include "esim/formats/prophesee/prophesee.h"
#include "esim/formats/recording_folder/recording_folder.h"
#include "esim/formats/ros/mcap/mcap_format.h"
#include "esim/formats/ros/rosbag/rosbag_format.h"
#include "esim/formats/ros/rosbag2/rosbag2_format.h"
#include "esim/formats/text/events_text.h"
#include "esim/recording/checked_source.h"
#include "esim/recording/recording_directory.h"

namespace esim::inline formats {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kHeadBytes = 4096;

std::string names() {
  std::string text;
  for (const Format& format : all_formats()) text += (text.empty() ? "" : ", ") + format.name;
  return text;
}

/// The extension of the path without a final .incomplete.
std::string extension_of(const fs::path& path) {
  return (path.extension() == ".incomplete" ? path.stem() : path).extension().string();
}

}  // namespace

// Order matters: the first format that recognises a file reads it; the first with its extension writes it.
const std::vector<Format>& all_formats() {
  // clang-format off
  static const std::vector<Format> all = {
      evt3_format(),
      evt2_format(),
      dat_format(),
      npy_format(),
      npz_format(),
      nmnist_format(),
      aedat4_zstd_format(),
      aedat4_format(),
      aedat2_format(),  // recognises every other version of AEDAT
      event_stream_format(),
      rosbag_format(),
      rosbag_packets_format(),
      mcap_format(),
      mcap_packets_format(),
      rosbag2_format(),
      rosbag2_packets_format(),
      rosbag2_file_format(),
      dataset_format(),
      dataset_folder_format(),
      m3ed_format(),
      v2e_format(),
      e2vid_format(),
      e2calib_format(),
      dsec_format(),  // recognises every other HDF5 file
      events_text_format(),  // recognises every other text
      recording_format(),
      flo_format(),
      kitti_format(),
      dsec_flow_format(),
      exr_format(),
      npy_truth_format(),
  };
  // clang-format on
  return all;
}

const Format& format_named(std::string_view name) {
  for (const Format& format : all_formats()) {
    if (format.name == name) return format;
  }
  throw UserError(fmt::format("unknown format \"{}\"; use one of {}", name, names()));
}

const Format& format_of(const fs::path& path) {
  std::error_code error;
  require_existing(path);
  const bool folder = fs::is_directory(path, error);
  const std::string head = folder ? std::string() : read_head(path, kHeadBytes);
  for (const Format& format : all_formats()) {
    if (format.folder == folder && format.recognises && format.recognises(path, head)) return format;
  }
  throw UserError(fmt::format("cannot read {}: it is not in any of the formats {}", path.string(), names()));
}

const Format* find_format_of_others(const fs::path& folder) {
  for (const Format& format : all_formats()) {
    const bool fits = format.folder && format.name != "recording" && format.can_hold(Content::events);
    if (fits && format.recognises && format.recognises(folder, "")) return &format;
  }
  return nullptr;
}

const Format* find_format_for(const fs::path& path) {
  const std::string extension = extension_of(path);
  for (const Format& format : all_formats()) {
    if (format.create && std::count(format.extensions.begin(), format.extensions.end(), extension) > 0) return &format;
  }
  return nullptr;
}

const Format& format_for(const fs::path& path) {
  if (const Format* format = find_format_for(path)) return *format;
  std::set<std::string> known;
  for (const Format& format : all_formats()) {
    if (format.create) known.insert(format.extensions.begin(), format.extensions.end());
  }
  known.erase("");  // of folders
  throw UserError(fmt::format("{}: no format has the extension \"{}\"; use one of {}, or name the format",
                              path.string(), extension_of(path), fmt::join(known, ", ")));
}

std::unique_ptr<Source> open_source(const fs::path& path, const ReadOptions& options) {
  const Format& format = format_of(path);
  return std::make_unique<CheckedSource>(format.open(path, options), path, options);
}

void require_camera(const Source& source, const fs::path& path) {
  if (!source.info().cameras.empty()) return;
  const std::vector<std::string> others = source.not_read();
  throw UserError(fmt::format("{} has no camera and therefore no events{}", path.string(),
                              others.empty() ? "" : "; not read: " + list_of_some(others)));
}

}  // namespace esim::inline formats
