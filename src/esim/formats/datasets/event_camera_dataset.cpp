#include "esim/formats/datasets/event_camera_dataset.h"

#include "esim/core/error.h"
#include "esim/formats/datasets/event_camera_dataset_files.h"
#include "esim/formats/datasets/event_camera_dataset_reader.h"
#include "esim/formats/datasets/event_camera_dataset_writer.h"
#include "esim/recording/recording_directory.h"

namespace esim::inline formats {
namespace {

namespace fs = std::filesystem;

const std::vector<Content> kContents = {Content::events, Content::frames, Content::imu, Content::poses};

/// A folder with an events.txt that does not belong to a recording.
bool is_dataset(const fs::path& folder) {
  const auto files = open_folder_input(folder);
  if (!files->has(kEventsTxt) || files->has("events.h5") || files->has("truth.h5")) return false;
  return !files->has("report.json") || has_conversion_report(folder);
}

/// A zip with an events.txt. A truncated zip is recognised by its first bytes, so that the error can name the damage.
bool is_zipped_dataset(const fs::path& path, std::string_view head) {
  if (!head.starts_with("PK\x03\x04")) return false;
  try {
    return open_zip_input(path, kEventsTxt)->has(kEventsTxt);
  } catch (const UserError&) {
    constexpr std::size_t kFirstName = 30;
    const std::string_view first = head.substr(std::min(kFirstName, head.size()), 64);
    return first.starts_with("events.txt") || first.starts_with("images/frame_") || first.starts_with("calib.txt");
  }
}

}  // namespace

Format dataset_format() {
  return {
      .name = "dataset",
      .description = "a zip file in the layout of the Event Camera Dataset",
      .extensions = {".zip"},
      .holds = kContents,
      .recognises = is_zipped_dataset,
      .open = [](const fs::path& path,
                 const ReadOptions& options) { return open_dataset(open_zip_input(path, kEventsTxt), options); },
      .create = [](const fs::path& path,
                   const WriteOptions&) { return make_dataset_writer([path] { return make_zip_output(path); }); },
  };
}

Format dataset_folder_format() {
  return {
      .name = "dataset-folder",
      .description = "a folder in the layout of the Event Camera Dataset",
      .holds = kContents,
      .folder = true,
      .recognises = [](const fs::path& path, std::string_view) { return is_dataset(path); },
      .open = [](const fs::path& path,
                 const ReadOptions& options) { return open_dataset(open_folder_input(path), options); },
      .create = [](const fs::path& path,
                   const WriteOptions&) { return make_dataset_writer([path] { return make_folder_output(path); }); },
  };
}

}  // namespace esim::inline formats
