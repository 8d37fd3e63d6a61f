#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "esim/formats/formats.h"

namespace esim::test {

/// A frame that owns its image.
struct OwnedFrame {
  int camera = 0;
  TimeNs t = 0, exposure_start = 0, exposure_duration = 0;
  int bits = 8;
  Image<std::uint16_t> image;

  FrameRecord record() const {
    return {.camera = camera,
            .t = t,
            .exposure_start = exposure_start,
            .exposure_duration = exposure_duration,
            .image = image,
            .bits = bits};
  }
};

/// All records of a file, by kind.
struct Recorded {
  RecordingInfo info;
  std::vector<std::vector<Event>> events;  ///< of each camera
  std::vector<OwnedFrame> frames;
  std::vector<ImuRecord> imu;
  std::vector<TriggerRecord> triggers;
  std::vector<PoseRecord> poses;
};

inline Recorded read_all(const std::filesystem::path& path, const ReadOptions& options = {}) {
  const auto source = open_source(path, options);
  Recorded all;
  all.info = source->info();
  all.events.resize(all.info.cameras.size());
  while (const Record* record = source->next()) {
    if (const auto* events = std::get_if<EventsRecord>(record)) {
      auto& of_camera = all.events.at(static_cast<std::size_t>(events->camera));
      of_camera.insert(of_camera.end(), events->events.begin(), events->events.end());
    }
    if (const auto* frame = std::get_if<FrameRecord>(record)) {
      all.frames.push_back(
          {frame->camera, frame->t, frame->exposure_start, frame->exposure_duration, frame->bits, frame->image});
    }
    if (const auto* imu = std::get_if<ImuRecord>(record)) all.imu.push_back(*imu);
    if (const auto* trigger = std::get_if<TriggerRecord>(record)) all.triggers.push_back(*trigger);
    if (const auto* pose = std::get_if<PoseRecord>(record)) all.poses.push_back(*pose);
  }
  return all;
}

/// A gradient up to the largest number, different for each `phase`.
inline OwnedFrame gradient_frame(int camera, TimeNs t, int width, int height, int bits, int phase) {
  OwnedFrame frame{camera, t, t - 500 * kNsPerUs, kNsPerMs, bits, Image<std::uint16_t>(width, height)};
  std::uint32_t number = static_cast<std::uint32_t>(phase);
  for (std::uint16_t& pixel : frame.image.pixels()) {
    pixel = static_cast<std::uint16_t>(number & ((1U << bits) - 1));
    number += 37;
  }
  frame.image(0, 0) = static_cast<std::uint16_t>((1U << bits) - 1);
  return frame;
}

}  // namespace esim::test
