// Writes small, whole files of every format that is written, NAME/seed, into a folder: where fuzzing begins.
#include <cstdio>
#include <filesystem>

#include "esim/core/error.h"
#include "esim/formats/formats.h"

namespace esim {
namespace {

RecordingInfo recording() {
  RecordingInfo info;
  CameraInfo& camera = info.cameras.emplace_back();
  camera.name = "cam0";
  camera.model = Camera{16, 12, 20, 20, 7.5, 5.5, RadialTangential{-0.1, 0.01, 0, 0, 0}};
  info.start = 0, info.end = kNsPerSecond;
  return info;
}

std::vector<Event> some_events() {
  std::vector<Event> events;
  for (int i = 0; i < 200; ++i) {
    events.push_back({i * i * 25 * kNsPerUs, static_cast<std::uint16_t>(i % 16), static_cast<std::uint16_t>(i / 7 % 12),
                      static_cast<std::int8_t>(i % 3 == 0 ? -1 : 1)});
  }
  return events;
}

void write(const Format& format, const std::filesystem::path& folder) {
  std::filesystem::create_directories(folder);
  const std::vector<Event> events = some_events();
  const Image<std::uint16_t> frame(16, 12, 100);
  const Image<float> image(16, 12, 0.5F);
  const auto sink = format.create(folder / "seed", {});
  sink->begin(recording());
  PoseRecord pose;
  sink->write(pose);
  sink->write(ImuRecord{kNsPerMs, {}, {}});
  sink->write(TriggerRecord{0, kNsPerMs, TriggerKind::external_rising});
  sink->write(TruthRecord{0, kNsPerMs, SE3{}, image, image, image, image});
  sink->write(EventsRecord{0, events});
  sink->write(FrameRecord{0, kNsPerSecond / 2, kNsPerSecond / 2, kNsPerMs, 1, frame, 8});
  sink->end(true);
}

}  // namespace
}  // namespace esim

int main(int argc, char** argv) {
  if (argc != 2) return std::fprintf(stderr, "usage: fuzz_seed FOLDER\n"), 2;
  const std::filesystem::path all = argv[1];
  for (const esim::Format& format : esim::all_formats()) {
    if (format.create && !format.folder) esim::write(format, all / format.name);
  }
  // The file in a folder is read alone.
  esim::write(esim::format_named("rosbag2"), all / "db3");
  std::filesystem::rename(all / "db3" / "seed" / "bag_0.db3", all / "db3" / "events");
  std::filesystem::remove_all(all / "db3" / "seed");
}
