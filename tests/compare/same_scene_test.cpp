#include "esim/compare/same_scene.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "esim/core/error.h"
#include "support/errors.h"

namespace esim {
namespace {

constexpr SensorSize kSensor{20, 10};

std::vector<Event> random_events(unsigned seed, std::size_t count) {
  std::mt19937 random(seed);
  std::vector<Event> events;
  for (std::size_t i = 0; i < count; ++i) {
    events.push_back({static_cast<TimeNs>(i) * 100'000, static_cast<std::uint16_t>(random() % 20),
                      static_cast<std::uint16_t>(random() % 10), static_cast<std::int8_t>(random() % 2 == 0 ? 1 : -1)});
  }
  return events;
}

TEST(CompareScenes, EqualRecordingsAreEqual) {
  const std::vector<Event> events = random_events(1, 5000);
  const SceneComparison found = compare_scenes(events, events, kSensor);
  EXPECT_EQ(found.events.matched, 5000);
  EXPECT_EQ(found.events.missing + found.events.spurious, 0);
  EXPECT_EQ(found.surfaces, 0);
  EXPECT_EQ(found.voxels, 0);
}

TEST(CompareScenes, NothingInCommonIsOne) {
  std::vector<Event> on, off;
  for (Event event : random_events(1, 5000)) {
    (event.x < 10 ? on : off).push_back({event.t, event.x, event.y, 1});
  }
  const SceneComparison found = compare_scenes(on, off, kSensor);
  EXPECT_EQ(found.events.matched, 0);
  EXPECT_EQ(found.surfaces, 1);
  EXPECT_EQ(found.voxels, 1);
}

TEST(CompareScenes, MissingEventsAndDelaysShow) {
  const std::vector<Event> all = random_events(3, 20'000);
  std::vector<Event> late, some;
  for (std::size_t i = 0; i < all.size(); ++i) {
    late.push_back(all[i]);
    late.back().t += 50'000;
    if (i % 10 != 5) some.push_back(all[i]);
  }
  const SceneComparison missing = compare_scenes(all, some, kSensor);
  EXPECT_EQ(missing.events.missing, 2000);
  EXPECT_EQ(missing.events.spurious, 0);
  const SceneComparison delayed = compare_scenes(all, late, kSensor);
  EXPECT_NEAR(delayed.events.median_s, 50e-6, 1e-9);
  EXPECT_GT(missing.voxels, 0.03);
  EXPECT_LT(missing.voxels, 0.12);
  EXPECT_LT(delayed.surfaces, 0.02);
  EXPECT_GT(delayed.surfaces, 0);
}

TEST(CompareScenes, OnlyTheCommonTimeCounts) {
  const std::vector<Event> events = random_events(4, 1000);
  const std::vector<Event> part(events.begin() + 200, events.begin() + 700);
  const SceneComparison found = compare_scenes(events, part, kSensor);
  EXPECT_EQ(found.events.reference, 500);
  EXPECT_EQ(found.events.missing, 0);
}

TEST(CompareScenes, RefusesRecordingsOfDifferentTimes) {
  const std::vector<Event> events = random_events(5, 100);
  std::vector<Event> later = events;
  for (Event& event : later) event.t += 1'000'000'000;
  const auto refusal = [&](const std::vector<Event>& other) {
    return test::message_of<UserError>([&] { compare_scenes(events, other, kSensor); });
  };
  EXPECT_TRUE(test::contains(refusal(later), "do not overlap in time"));
  EXPECT_TRUE(test::contains(refusal({}), "no events"));
}

}  // namespace
}  // namespace esim
