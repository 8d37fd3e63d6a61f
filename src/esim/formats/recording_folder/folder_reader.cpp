#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>
#include <utility>

#include "esim/core/error.h"
#include "esim/files/input_file.h"
#include "esim/formats/hdf5/dsec.h"
#include "esim/formats/images/timed_files.h"
#include "esim/formats/recording_folder/folder_streams.h"
#include "esim/formats/recording_folder/recording_folder.h"
#include "esim/formats/text/events_text.h"
#include "esim/geometry/calibration.h"
#include "esim/recording/checked_source.h"
#include "esim/recording/recording_directory.h"

namespace esim::inline formats {

namespace fs = std::filesystem;

namespace {

bool is_file(const fs::path& path) {
  std::error_code error;
  return fs::is_regular_file(path, error);
}

}  // namespace

bool is_camera_folder(const fs::path& folder) {
  return is_file(folder / "events.h5") || is_file(folder / "truth.h5") || is_file(folder / "frames.csv") ||
         is_file(folder / "images" / kTimedFilesList);
}

namespace {

std::vector<fs::path> sorted_entries(const fs::path& folder) {
  std::vector<fs::path> paths;
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error))
    paths.push_back(entry->path());
  std::sort(paths.begin(), paths.end());
  return paths;
}

}  // namespace

std::vector<std::string> sensors_in(const fs::path& folder) {
  std::vector<std::string> names;
  for (const fs::path& sensor : sorted_entries(folder)) {
    if (is_file(sensor / "events.h5")) names.push_back(sensor.filename().string());
  }
  return names;
}

namespace {

std::vector<CameraInfo> cameras_in_folders(const fs::path& root) {
  std::vector<CameraInfo> cameras;
  for (const fs::path& folder : sorted_entries(root)) {
    if (!is_camera_folder(folder)) continue;
    cameras.emplace_back();
    cameras.back().name = folder.filename().string();
  }
  return cameras;
}

bool is_recording(const fs::path& path) {
  const bool has_parts = is_file(path / "calibration" / "rig.yaml") || is_file(path / "states.csv") ||
                         is_file(path / "imu.csv") || is_camera_folder(path) || !cameras_in_folders(path).empty();
  return has_parts || (is_file(path / "report.json") && !has_conversion_report(path));
}

/// Frames per second: the shortest number that gives exactly these times, if there is one. 0: unknown.
double rate_of(const TruthHdf5Reader& truth) {
  const std::uint64_t frames = truth.size();
  if (frames < 2 || truth.t(frames - 1) <= truth.t(0)) return 0;
  const double rate_hz = static_cast<double>(frames - 1) / to_seconds(truth.t(frames - 1) - truth.t(0));
  for (double unit = 1; unit < 1e9; unit *= 10) {
    const double shorter_hz = std::round(rate_hz * unit) / unit;
    if (!(shorter_hz > 0)) continue;
    const auto due = [&](std::uint64_t k) { return truth.t(0) + to_ns(static_cast<double>(k) / shorter_hz); };
    std::uint64_t same = 0;
    while (same < frames && truth.t(same) == due(same)) ++same;
    if (same == frames) return shorter_hz;
  }
  return rate_hz;
}

/// Reads one folder: first the description of the recording, then its streams.
class RecordingFolder {
 public:
  RecordingFolder(const fs::path& path, const ReadOptions& options) : options_(options) {
    if (!is_camera_folder(path)) {
      root_ = path;
      attempt([&] { read_rig(); });
      for (CameraInfo& camera : info_.cameras) folders_.push_back(root_ / camera.name);
      add_sensors();
      return;
    }
    // The folder of a camera, or of one of its event sensors, by itself. "DIR/cam0/" and "DIR/cam0" are the same.
    const fs::path folder = fs::absolute(path / ".").lexically_normal().parent_path();
    root_ = folder.parent_path();
    CameraInfo own;
    own.name = folder.filename().string();
    if (!is_file(root_ / "report.json") && is_file(root_.parent_path() / "report.json")) {
      own.name = (root_.filename() / own.name).string();
      root_ = root_.parent_path();
    }
    attempt([&] { read_rig(); });
    for (const CameraInfo& camera : info_.cameras) {
      if (camera.name != own.name && !own.name.starts_with(camera.name + "/")) continue;
      const std::string name = own.name;
      own = camera;
      own.name = name;
    }
    info_.cameras = {own};
    info_.imu.reset();
    folders_ = {path};
    alone_ = true;
    add_sensors();
  }

  std::unique_ptr<Source> open() {
    if (!alone_) open_body();
    for (std::size_t i = 0; i < folders_.size(); ++i) {
      attempt([&] { open_events(i); });
      attempt([&] { open_truth(i); });
    }
    require_something();
    std::vector<std::unique_ptr<RecordStream>> streams;
    for (auto* group : {&body_, &events_, &frames_, &truth_})
      std::move(group->begin(), group->end(), std::back_inserter(streams));
    if (!start_) start_ = events_start_;
    info_.start_known = start_.has_value();
    return merge_streams(std::move(info_), std::move(streams), options_, start_);
  }

 private:
  /// Adds the event sensors that share the lenses of the cameras.
  void add_sensors() {
    const std::size_t lenses = info_.cameras.size();
    for (std::size_t i = 0; i < lenses; ++i) {
      for (const std::string& name : sensors_in(folders_[i])) {
        CameraInfo sensor = info_.cameras[i];
        sensor.name += "/" + name;
        sensor.lens = static_cast<int>(i);
        info_.cameras.push_back(sensor);
        folders_.push_back(folders_[i] / name);
      }
    }
  }

  /// With `recover`, continues if a part cannot be read.
  template <typename Part>
  void attempt(const Part& read) {
    try {
      read();
    } catch (const UserError& error) {
      if (!options_.recover) throw;
      options_.recover(error.what());
    }
  }

  /// A recording without events is valid. An empty one, or the beginning of an unfinished one, is not.
  void require_something() const {
    const bool any = !body_.empty() || !events_.empty() || !frames_.empty() || !truth_.empty();
    if (any || (!info_.cameras.empty() && !unfinished_)) return;
    if (!unfinished_) throw UserError(fmt::format("{} holds no records", root_.string()));
    if (is_being_written(root_))
      throw UserError(fmt::format("{} is being written, and holds no records yet", root_.string()));
    throw UserError(fmt::format(
        "{} holds no records: the program that wrote it was stopped before the first record; create it again",
        root_.string()));
  }

  bool is_there(const fs::path& path) const { return unfinished_ ? has_begun(path) : is_file(path); }

  void read_rig() {
    if (is_file(root_ / "report.json")) attempt([&] { read_report(root_ / "report.json"); });
    const fs::path calibration = root_ / "calibration";
    if (is_file(calibration / "rig.yaml")) attempt([&] { read_calibrations(calibration); });
    if (info_.cameras.empty()) info_.cameras = cameras_in_folders(root_);
    std::set<std::string> names;
    for (CameraInfo& camera : info_.cameras) {
      if (camera.name.empty() || camera.name.find('/') != std::string::npos || camera.name == ".." ||
          !names.insert(camera.name).second)
        throw UserError(fmt::format("cannot read {}: the camera name \"{}\" must be unique and the name of a folder",
                                    root_.string(), camera.name));
      if (!options_.sensor) continue;
      camera.model.width = options_.sensor->width, camera.model.height = options_.sensor->height;
    }
  }

  void read_report(const fs::path& path) {
    constexpr std::size_t kMaxBytes = std::size_t{1} << 24;
    InputFile file(path);
    const auto bytes = file.read(kMaxBytes);
    try {
      const auto report = nlohmann::json::parse(reinterpret_cast<const char*>(bytes.data()),
                                                reinterpret_cast<const char*>(bytes.data()) + bytes.size());
      unfinished_ = report.value("status", "complete") != "complete";
      if (report.contains("start_s")) {
        const double start_s = report.at("start_s"), length_s = report.value("simulated_s", 0.0);
        constexpr double kMax_s = 4e9;
        if (!(std::abs(start_s) <= kMax_s) || !(length_s >= 0 && length_s <= kMax_s))
          file.fail(0, "its times are invalid");
        start_ = to_ns(start_s);
        info_.end = *start_ + to_ns(length_s);
      }
      for (const auto& entry : report.value("cameras", nlohmann::json::array())) {
        CameraInfo camera;
        camera.name = entry.at("name");
        camera.model.width = entry.at("width"), camera.model.height = entry.at("height");
        constexpr int kMaxExtent = 65536;
        if (std::min(camera.model.width, camera.model.height) < 0 ||
            std::max(camera.model.width, camera.model.height) > kMaxExtent)
          file.fail(0, "the size of a camera is invalid");
        info_.cameras.push_back(std::move(camera));
      }
    } catch (const nlohmann::json::exception& error) {
      info_.cameras.clear();
      file.fail(0, fmt::format("it is not a report of a recording ({})", error.what()));
    }
  }

  /// rig.yaml has the cameras in the body frame; camchain.yaml has them relative to the IMU.
  void read_calibrations(const fs::path& folder) {
    std::vector<CameraInfo> cameras;
    for (auto& [name, model, T_body_camera] : geometry::read_calibration(folder / "rig.yaml"))
      cameras.push_back({name, model, T_body_camera});
    info_.cameras = std::move(cameras);
    if (!is_file(folder / "imu.yaml")) return;
    const CalibratedImu imu = read_imu_calibration(folder / "imu.yaml");
    const SE3 T_imu_camera = geometry::read_calibration(folder / "camchain.yaml").front().T_body_camera;
    info_.imu = ImuInfo{info_.cameras.front().T_body_camera * T_imu_camera.inverse(),
                        imu.rate_hz,
                        imu.gyroscope_noise_density,
                        imu.gyroscope_random_walk,
                        imu.accelerometer_noise_density,
                        imu.accelerometer_random_walk};
  }

  void open_body() {
    if (is_there(root_ / "states.csv")) {
      attempt([&] {
        const std::vector<fs::path> objects = read_objects(root_ / "objects");
        body_.push_back(poses_stream(root_ / "states.csv", objects, unfinished_));
      });
    }
    if (is_there(root_ / "imu.csv")) {
      if (!info_.imu) info_.imu.emplace();
      attempt([&] { body_.push_back(imu_stream(root_ / "imu.csv", root_ / "imu_truth.csv", unfinished_)); });
    }
  }

  /// The files of the moving objects; sets their names. Without names.txt, they are in the order of the file names.
  std::vector<fs::path> read_objects(const fs::path& folder) {
    std::vector<fs::path> files;
    if (is_file(folder / "names.txt")) {
      constexpr std::size_t kMaxLineBytes = 1 << 12;
      for (InputFile list(folder / "names.txt"); list.offset() < list.size();) {
        const std::uint64_t offset = list.offset();
        const std::string_view line = list.read_line(kMaxLineBytes, "a line");
        const std::size_t end = line.find(' ');
        const std::string_view name = line.substr(0, end);
        if (end == std::string_view::npos || name.find('/') != std::string_view::npos)
          list.fail(offset, "expected the name of a file in this folder, then that of the object");
        files.push_back(folder / name);
        info_.objects.emplace_back(line.substr(end + 1));
      }
      return files;
    }
    for (const fs::path& file : sorted_entries(folder)) {
      if (file.extension() != ".csv") continue;
      files.push_back(file);
      info_.objects.push_back(file.stem().string());
    }
    return files;
  }

  void open_events(std::size_t i) {
    const auto path = events_file_in(folders_[i]);
    if (!path || !is_there(*path)) return;
    const fs::path& file = *path;
    const bool text = file.extension() == ".txt";
    const ReadOptions told{.sensor = options_.sensor};
    auto events =
        std::make_unique<CheckedSource>((text ? events_text_format() : dsec_format()).open(file, told), file, told);
    const Camera& found = events->info().cameras.front().model;
    learn_size(i, {found.width, found.height});
    info_.cameras[i].has_labels = events->info().cameras.front().has_labels;
    info_.end = std::max(info_.end, events->info().end);
    if (const RecordingInfo& own = events->info(); own.start_known)
      events_start_ = std::min(events_start_.value_or(own.start), own.start);
    events_.push_back(events_stream(std::move(events), static_cast<int>(i)));
  }

  void open_truth(std::size_t i) {
    const int camera = static_cast<int>(i);
    info_.cameras[i].has_frames = is_there(folders_[i] / "frames.csv");
    if (info_.cameras[i].has_frames)
      attempt([&] { frames_.push_back(frames_stream(folders_[i], camera, unfinished_)); });
    ImagesStream* images = nullptr;
    if (is_there(folders_[i] / "images" / kTimedFilesList)) {
      attempt([&] {
        auto stream = std::make_unique<ImagesStream>(folders_[i] / "images", camera, unfinished_);
        images = stream.get();
        truth_.push_back(std::move(stream));
      });
    }
    if (!is_there(folders_[i] / "truth.h5")) return;
    const auto truth = std::make_shared<TruthHdf5Reader>(folders_[i] / "truth.h5");
    learn_size(i, truth->sensor());
    if (truth->size() > 0) info_.end = std::max(info_.end, truth->t(truth->size() - 1));
    if (const double rate_hz = rate_of(*truth); rate_hz > 0) info_.truth_rate_hz = rate_hz;
    learn_names(*truth);
    truth_.push_back(truth_stream(truth, camera, images));
  }

  void learn_size(std::size_t i, SensorSize size) {
    Camera& model = info_.cameras[i].model;
    if (model.width == 0) model.width = size.width, model.height = size.height;
  }

  /// The names are "static", then the objects, then the sprites.
  void learn_names(const TruthHdf5Reader& truth) {
    const std::vector<std::string>& names = truth.names();
    const std::size_t objects = info_.objects.empty() ? truth.objects() : info_.objects.size();
    if (names.size() < 1 + objects) return;
    const auto sprites = names.begin() + 1 + static_cast<std::ptrdiff_t>(objects);
    info_.objects.assign(names.begin() + 1, sprites);
    info_.sprites.assign(sprites, names.end());
  }

  ReadOptions options_;
  fs::path root_;
  std::vector<fs::path> folders_;  // of the cameras
  bool alone_ = false;             // a camera's folder alone, without the rig's files
  bool unfinished_ = false;        // by its report: killed, interrupted, or still being written
  RecordingInfo info_;
  std::optional<TimeNs> start_;         // from the report
  std::optional<TimeNs> events_start_;  // from the events files
  std::vector<std::unique_ptr<RecordStream>> body_, events_, frames_, truth_;
};

}  // namespace

Format recording_format() {
  return {
      .name = "recording",
      .description = "the folder of a recording, or of one of its cameras",
      .extensions = {""},
      .holds = {Content::events, Content::event_labels, Content::frames, Content::images, Content::imu, Content::poses,
                Content::truth, Content::optical_flow},
      .several_cameras = true,
      .folder = true,
      .either_unit = true,
      .recognises = [](const auto& path, std::string_view) { return is_recording(path); },
      .open = [](const auto& path, const ReadOptions& options) { return RecordingFolder(path, options).open(); },
      .create = [](const auto& path,
                   const WriteOptions& options) { return std::make_unique<RecordingWriter>(path, options); },
  };
}

}  // namespace esim::inline formats
