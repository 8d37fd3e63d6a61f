#pragma once

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "esim/recording/record.h"

namespace esim::test {

/// One camera, cam0.
inline RecordingInfo recording_info(int width, int height, TimeNs start, TimeNs end, double truth_rate_hz = 0) {
  CameraInfo camera;
  camera.name = "cam0";
  camera.model.width = width;
  camera.model.height = height;
  RecordingInfo info;
  info.cameras.push_back(camera);
  info.start = start;
  info.end = end;
  info.truth_rate_hz = truth_rate_hz;
  return info;
}

/// Ordered events after `start` and up to `end`: bursts at one time, pauses of many milliseconds, and events exactly on
/// milliseconds and one nanosecond before.
inline std::vector<Event> random_events(std::size_t count, int width, int height, TimeNs start, TimeNs end,
                                        unsigned seed = 1) {
  std::mt19937_64 random(seed);
  const auto below = [&](std::int64_t bound) {
    return static_cast<std::int64_t>(random() % static_cast<std::uint64_t>(std::max<std::int64_t>(bound, 1)));
  };
  std::vector<Event> events(count);
  TimeNs t = start + 1;
  for (Event& event : events) {
    switch (below(20)) {
      case 0:
        t = start + 1 + below(end - start);
        break;
      case 1:
        t = std::clamp(t / kNsPerMs * kNsPerMs, start + 1, end);
        break;
      case 2:
        t = std::clamp(t / kNsPerMs * kNsPerMs - 1, start + 1, end);
        break;
      case 3:
        t = std::min(t + below(3000), end);
        break;
      default:
        break;  // the burst continues
    }
    event = {t, static_cast<std::uint16_t>(below(width)), static_cast<std::uint16_t>(below(height)),
             static_cast<std::int8_t>(below(2) == 0 ? 1 : -1)};
  }
  std::sort(events.begin(), events.end());
  return events;
}

/// Passes events to a sink in batches of random size, including empty ones.
inline void write_in_batches(Sink& sink, const std::vector<Event>& events, std::size_t largest, unsigned seed = 1) {
  std::mt19937 random(seed);
  for (std::size_t done = 0; done < events.size();) {
    const std::size_t count = std::min<std::size_t>(random() % (largest + 1), events.size() - done);
    sink.write(EventsRecord{0, EventSpan(events).subspan(done, count)});
    done += count;
  }
}

inline void record(Sink& sink, const RecordingInfo& info, const std::vector<Event>& events, bool complete = true) {
  sink.begin(info);
  write_in_batches(sink, events, 4096);
  sink.end(complete);
}

inline std::string content(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

inline std::vector<std::string> lines(const std::filesystem::path& path) {
  std::ifstream file(path);
  std::vector<std::string> all;
  for (std::string line; std::getline(file, line);) all.push_back(line);
  return all;
}

/// Images of one ground-truth frame, smooth and different at each time, with a sky without depth.
struct TruthImages {
  TruthImages(int width, int height, double t_s)
      : irradiance(width, height), depth(width, height), motion_x(width, height), motion_y(width, height) {
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        const double u = static_cast<double>(x) / width, v = static_cast<double>(y) / height;
        irradiance(x, y) = static_cast<float>(0.5 + 0.5 * std::sin(20 * (u + t_s)) * std::cos(15 * v));
        depth(x, y) = v < 0.2 ? std::numeric_limits<float>::infinity() : static_cast<float>(1 + u + v);
        motion_x(x, y) = static_cast<float>(-100 * (1 - v) + 10 * t_s);
        motion_y(x, y) = static_cast<float>(30 * (u - 0.5));
      }
    }
  }
  TruthRecord at(TimeNs t, SE3 T_world_camera = {}) const {
    return {0, t, T_world_camera, irradiance, depth, motion_x, motion_y};
  }

  Image<float> irradiance, depth, motion_x, motion_y;
};

/// While it exists, files of this process cannot grow beyond `bytes`: writing fails as on a full disk.
class FileSizeLimit {
 public:
  explicit FileSizeLimit(rlim_t bytes) {
    handler_ = signal(SIGXFSZ, SIG_IGN);
    getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit limit{bytes, before_.rlim_max};
    setrlimit(RLIMIT_FSIZE, &limit);
  }
  ~FileSizeLimit() {
    setrlimit(RLIMIT_FSIZE, &before_);
    signal(SIGXFSZ, handler_);
  }
  FileSizeLimit(const FileSizeLimit&) = delete;
  FileSizeLimit& operator=(const FileSizeLimit&) = delete;

 private:
  rlimit before_{};
  sighandler_t handler_ = SIG_DFL;
};

}  // namespace esim::test
