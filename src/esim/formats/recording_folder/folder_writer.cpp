#include <algorithm>
#include <nlohmann/json.hpp>
#include <set>
#include <string_view>
#include <utility>

#include "esim/core/error.h"
#include "esim/files/output_file.h"
#include "esim/formats/hdf5/dsec.h"
#include "esim/formats/hdf5/truth.h"
#include "esim/formats/images/frames_png.h"
#include "esim/formats/images/images_png.h"
#include "esim/formats/recording_folder/calibration_files.h"
#include "esim/formats/recording_folder/event_points_ply.h"
#include "esim/formats/recording_folder/recording_folder.h"
#include "esim/formats/text/imu_csv.h"
#include "esim/formats/text/poses_tum.h"
#include "esim/formats/text/states_csv.h"
#include "esim/recording/fan_out.h"

namespace esim::inline formats {
namespace {

/// The camera of a record; -1: no camera.
int camera_index_of(const Record& record) {
  const auto camera = [](const auto& kind) {
    if constexpr (requires { kind.camera; }) return kind.camera;
    return -1;
  };
  return std::visit(camera, record);
}

TimeNs time_of(const Record& record) {
  const auto time = [](const auto& kind) -> TimeNs {
    if constexpr (requires { kind.events; }) return kind.events.empty() ? 0 : kind.events.back().t;
    if constexpr (requires { kind.t1; }) return kind.t1;
    if constexpr (requires { kind.t; }) return kind.t;
  };
  return std::visit(time, record);
}

bool is_plain(std::string_view name) {
  return !name.empty() && name.find_first_not_of("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-") ==
                              std::string_view::npos;
}

/// Gives every camera a unique name that is valid for a folder; that of an event sensor that shares a lens is in the
/// folder of its camera.
void name_folders(std::vector<CameraInfo>& cameras) {
  std::set<std::string> taken = {"calibration", "objects"};
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    std::string& name = cameras[i].name;
    bool plain = is_plain(name);
    if (cameras[i].lens >= 0) {
      const std::string lens = cameras[static_cast<std::size_t>(cameras[i].lens)].name;
      const std::string sensor = name.substr(name.find('/') + 1);
      name = lens + "/" + sensor;
      plain = is_plain(sensor);
    }
    if (plain && taken.insert(name).second) continue;
    for (std::size_t number = i; !taken.insert(name = "cam" + std::to_string(number)).second;) ++number;
  }
}

bool is_calibrated(const CameraInfo& camera) { return camera.model.width > 0 && camera.model.fx > 0; }

}  // namespace

void RecordingWriter::begin(const RecordingInfo& info) {
  info_ = info;
  end_ = info.end;
  name_folders(info_.cameras);
  create_folder(folder_);
  if (info_.cameras.empty() || !std::all_of(info_.cameras.begin(), info_.cameras.end(), is_calibrated)) return;
  RecordingInfo calibrated = info_;
  if (calibrated.imu && calibrated.imu->rate_hz <= 0) calibrated.imu.reset();
  CalibrationWriter(folder_ / "calibration").begin(calibrated);
}

void RecordingWriter::write(const Record& record) {
  end_ = std::max(end_, time_of(record));
  if (const auto* truth = std::get_if<TruthRecord>(&record)) {
    auto& [before, last] = truth_times_[truth->camera];
    before = std::exchange(last, truth->t);
    if (!truth->irradiance.empty()) sink_of(Content::images, record).write(record);
  }
  if (const auto* optical_flow = std::get_if<OpticalFlowRecord>(&record)) {
    if (truth_times_[optical_flow->camera] !=
        std::pair(std::optional(optical_flow->t0), std::optional(optical_flow->t1)))
      throw OutputError("cannot write " + folder_.string() +
                        ": recordings store optical flow with the ground-truth frames that it connects, but the input "
                        "has no such frames; write the format flo or kitti instead");
  }
  const Content content = content_of(record);
  sink_of(content == Content::optical_flow ? Content::truth : content, record).write(record);
}

Sink& RecordingWriter::sink_of(Content content, const Record& record) {
  std::unique_ptr<Sink>& sink = sinks_[{content, camera_index_of(record)}];
  if (sink == nullptr) {
    sink = make_sink(content, record);
    sink->begin(info_);
  }
  return *sink;
}

std::unique_ptr<Sink> RecordingWriter::make_sink(Content content, const Record& record) {
  const int camera = camera_index_of(record);
  std::filesystem::path place = folder_;
  if (camera >= 0) create_folder(place /= info_.cameras.at(static_cast<std::size_t>(camera)).name);
  switch (content) {
    case Content::events:
    case Content::event_labels:
      return std::make_unique<EventsHdf5Writer>(place / "events.h5", camera,
                                                EventsHdf5Options{options_.unit, options_.compression});
    case Content::frames:
      return std::make_unique<FramesPngWriter>(place, camera);
    case Content::images:
      return std::make_unique<ImagesPngWriter>(place / "images", camera);
    case Content::imu:
      return std::make_unique<ImuCsvWriter>(place);
    case Content::event_points:
      return std::make_unique<EventPointsPlyWriter>(place / "event_points.ply", camera);
    case Content::poses: {
      auto both = std::make_unique<FanOut>();
      both->add(std::make_unique<PosesTumWriter>(place / "poses.txt"));
      both->add(std::make_unique<StatesCsvWriter>(place));
      return both;
    }
    case Content::triggers:
      throw InternalError("recordings have no file of triggers");
    case Content::truth:
    case Content::optical_flow:
      break;
  }
  const auto& truth = std::get<TruthRecord>(record);
  Camera& model = info_.cameras[static_cast<std::size_t>(camera)].model;
  if (model.width == 0) {
    const Image<float>& image = truth.depth.empty() ? truth.motion_x : truth.depth;
    model.width = image.width(), model.height = image.height();
  }
  return std::make_unique<TruthHdf5Writer>(
      place / "truth.h5", camera,
      TruthHdf5Options{!truth.depth.empty(), !truth.motion_x.empty(), options_.compression, truth.object != nullptr});
}

void RecordingWriter::end(bool complete) {
  for (const auto& [key, sink] : sinks_) sink->end(complete);
  sinks_.clear();
  nlohmann::ordered_json cameras = nlohmann::ordered_json::array();
  for (const CameraInfo& camera : info_.cameras) {
    if (camera.lens >= 0) continue;  // found by its folder
    cameras.push_back({{"name", camera.name}, {"width", camera.model.width}, {"height", camera.model.height}});
  }
  nlohmann::ordered_json report = {{"status", complete ? "complete" : "interrupted"}};
  if (info_.start_known) {
    report["start_s"] = to_seconds(info_.start);
    report["simulated_s"] = to_seconds(std::max(end_, info_.start) - info_.start);
  }
  report["cameras"] = cameras;
  write_file_atomically(folder_ / "report.json", report.dump(2) + "\n");
}

}  // namespace esim::inline formats
