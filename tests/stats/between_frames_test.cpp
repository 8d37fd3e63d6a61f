#include "esim/stats/between_frames.h"

#include <gtest/gtest.h>

#include <random>

#include "stats/streams.h"

namespace esim {
namespace {

/// Frames at given times, and events between them; the fraction `bunched` lies in the last 2 % before the next frame.
PhaseTest test_of(const std::vector<TimeNs>& frames, double bunched, bool all_at_once = false) {
  constexpr int kPerInterval = 1000;
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform;
  BetweenFrames between;
  const Image<float> image(2, 2);
  std::vector<Event> all;
  between.write(ImageRecord{0, frames.front(), image});
  for (std::size_t k = 1; k < frames.size(); ++k) {
    std::vector<TimeNs> times;
    for (int i = 0; i < kPerInterval; ++i) {
      const double place = uniform(random) < bunched ? 0.98 + 0.02 * uniform(random) : uniform(random);
      times.push_back(frames[k] - static_cast<TimeNs>((1 - place) * static_cast<double>(frames[k] - frames[k - 1])));
    }
    std::sort(times.begin(), times.end());
    const std::vector<Event> events = test::events_at(times, 8, 8, 1);
    all.insert(all.end(), events.begin(), events.end());
    if (all_at_once) continue;
    between.write(EventsRecord{0, events});
    between.write(EventsRecord{1, events});
    between.write(ImageRecord{0, frames[k], image});
    between.write(ImageRecord{1, frames[k], image});
  }
  if (all_at_once) {
    for (std::size_t k = 1; k < frames.size(); ++k) between.write(ImageRecord{0, frames[k], image});
    between.write(EventsRecord{0, all});
  }
  return between.test();
}

std::vector<TimeNs> frames_every(std::vector<TimeNs> intervals, int count, TimeNs start) {
  std::vector<TimeNs> frames{start};
  for (int k = 0; k < count; ++k)
    frames.push_back(frames.back() + intervals[static_cast<std::size_t>(k) % intervals.size()]);
  return frames;
}

TEST(BetweenFrames, EvenOnesAndThoseThatBunch) {
  for (const TimeNs start : {TimeNs{0}, 1'234'567'890'123'456'789, TimeNs{-7'000'000'001}}) {
    for (const auto& intervals : {std::vector<TimeNs>{33'333'333}, {20'000'000, 41'000'000, 60'700'000}}) {
      const auto frames = frames_every(intervals, 60, start);
      const PhaseTest even = test_of(frames, 0), bunched = test_of(frames, 0.2);
      EXPECT_EQ(even.banding, Banding::none) << start;
      EXPECT_NEAR(static_cast<double>(even.events), 60'000, 1);
      EXPECT_EQ(bunched.banding, Banding::strong);
      // A fraction a in w = 2 % of the interval, the others uniform: the rms is a sqrt(1 / w - 1).
      EXPECT_NEAR(bunched.modulation, 0.2 * std::sqrt(1 / 0.02 - 1), 0.25);
      EXPECT_EQ(test_of(frames, 0.2, true).modulation, bunched.modulation) << "independent of the portions";
    }
  }
}

TEST(BetweenFrames, TooLittleToTell) {
  EXPECT_EQ(BetweenFrames().test().banding, Banding::unknown);
  EXPECT_EQ(test_of({0}, 0).banding, Banding::unknown);
  EXPECT_EQ(test_of(frames_every({1'000'000}, 10, 0), 0.5).banding, Banding::unknown) << "only ten periods";
}

}  // namespace
}  // namespace esim
