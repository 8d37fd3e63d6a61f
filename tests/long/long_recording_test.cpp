// Recordings of ten minutes and fifty million events in the studio.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <random>

#include "esim/formats/hdf5/dsec.h"
#include "esim/studio/recordings/recording_view.h"
#include "esim/studio/recordings/recordings.h"
#include "support/temporary_directory.h"

namespace esim::studio {
namespace {

constexpr std::uint64_t kEvents = 50'000'000;
constexpr TimeNs kEnd = 600 * kNsPerSecond;

void write_long_recording(const std::filesystem::path& file) {
  EventsHdf5Writer writer(file, 0);
  RecordingInfo info;
  info.cameras.resize(1);
  info.cameras[0].name = "cam0";
  info.cameras[0].model.width = 346, info.cameras[0].model.height = 260;
  info.end = kEnd;
  writer.begin(info);
  std::mt19937 random(1);
  std::vector<Event> events(1'000'000);
  std::uint64_t done = 0;
  while (done < kEvents) {
    for (Event& event : events) {
      event.t = static_cast<TimeNs>(done++) * (kEnd / static_cast<TimeNs>(kEvents));
      event.x = static_cast<std::uint16_t>(random() % 346), event.y = static_cast<std::uint16_t>(random() % 260);
      event.polarity = random() % 2 == 0 ? 1 : -1;
    }
    writer.write(EventsRecord{0, events});
  }
  writer.end(true);
}

template <typename Work>
double seconds(const Work& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

TEST(LongRecording, OpensAtOnceAndStaysSmooth) {
  const test::TemporaryDirectory folder;
  const auto file = folder.path() / "events.h5";
  write_long_recording(file);

  std::unique_ptr<OpenRecording> recording;
  const double opening = seconds([&] { recording = std::make_unique<OpenRecording>(file); });
  EXPECT_LT(opening, 3.0);
  const EventStore& events = *recording->view()->camera("").events;
  EXPECT_EQ(events.size(), kEvents);

  // The events of an image at any time, of a 4 s plot, and of the complete curve of rates.
  std::mt19937 random(2);
  std::vector<double> looks;
  for (int i = 0; i < 50; ++i) {
    const TimeNs t = static_cast<TimeNs>(random() % 600) * kNsPerSecond;
    looks.push_back(seconds([&] {
      const auto range = events.find(t, t + 20 * kNsPerMs);
      EXPECT_NEAR(static_cast<double>(events.read(range.first, range.end - range.first).size()), 1667, 2);
    }));
  }
  std::sort(looks.begin(), looks.end());
  EXPECT_LT(looks[45], 0.1);
  std::size_t shown = 0;
  const double plot =
      seconds([&] { shown = events.thinned(events.find(100 * kNsPerSecond, 104 * kNsPerSecond), 100'000).size(); });
  EXPECT_EQ(shown, 100'000U);
  EXPECT_LT(plot, 1.0);
  EventRate rate;
  const double first_curve = seconds([&] { rate = events.rate(0, kEnd, 1000); });
  const double curve = seconds([&] { rate = events.rate(0, kEnd, 900); });
  std::uint64_t all = 0;
  for (std::size_t i = 0; i < rate.on.size(); ++i) all += rate.on[i] + rate.off[i];
  EXPECT_EQ(all, kEvents);
  EXPECT_LT(first_curve, 5.0);
  EXPECT_LT(curve, 0.1);
  std::printf("opened in %.3f s; picture %.4f s (median), plot %.3f s, curve %.3f s, then %.4f s\n", opening, looks[25],
              plot, first_curve, curve);
}

}  // namespace
}  // namespace esim::studio
