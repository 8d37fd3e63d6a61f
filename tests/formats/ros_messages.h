#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "esim/formats/formats.h"
#include "esim/formats/ros/messages/messages.h"
#include "formats/recordings.h"

namespace esim::test {

/// The bytes of a message.
template <typename T>
std::string encoded(const T& message, ros::Encoding encoding) {
  std::string bytes;
  ros::MessageWriter(encoding, bytes)(message);
  return bytes;
}

/// The messages of a file, as values.
struct ReadBack {
  struct Frame {
    TimeNs t = 0, exposure_start = 0, exposure_duration = 0;
    double gain = 0;
    int bits = 0, camera = 0;
    Image<std::uint16_t> image{};
  };
  struct Truth {
    int camera = 0;
    TimeNs t = 0;
    SE3 T_world_camera{};
    Image<float> irradiance{}, depth{}, motion_x{}, motion_y{};
  };

  RecordingInfo info{};
  std::vector<std::vector<Event>> events{};  // of each camera
  std::vector<Frame> frames{};
  std::vector<Truth> truth{};
  std::vector<TimeNs> images{};
  std::vector<ImuRecord> imu{};
  std::vector<PoseRecord> poses{};
  std::optional<std::string> problem{};
};

/// All messages of a file, up to its damage, if any.
inline ReadBack read_back(const std::filesystem::path& path) {
  ReadBack all;
  const auto source = open_source(path, {.recover = [&](const std::string& problem) { all.problem = problem; }});
  all.info = source->info();
  all.events.resize(all.info.cameras.size());
  while (const Record* record = source->next()) {
    if (const auto* events = std::get_if<EventsRecord>(record)) {
      std::vector<Event>& to = all.events[static_cast<std::size_t>(events->camera)];
      to.insert(to.end(), events->events.begin(), events->events.end());
    } else if (const auto* frame = std::get_if<FrameRecord>(record)) {
      all.frames.push_back({frame->t, frame->exposure_start, frame->exposure_duration, frame->gain, frame->bits,
                            frame->camera, frame->image});
    } else if (const auto* truth = std::get_if<TruthRecord>(record)) {
      all.truth.push_back({truth->camera, truth->t, truth->T_world_camera, truth->irradiance, truth->depth,
                           truth->motion_x, truth->motion_y});
    } else if (const auto* image = std::get_if<ImageRecord>(record)) {
      all.images.push_back(image->t);
    } else if (const auto* imu = std::get_if<ImuRecord>(record)) {
      all.imu.push_back(*imu);
    } else if (const auto* pose = std::get_if<PoseRecord>(record)) {
      all.poses.push_back(*pose);
    }
  }
  return all;
}

}  // namespace esim::test
