#include "esim/represent/representations.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "esim/core/error.h"
#include "esim/core/random.h"
#include "support/errors.h"

namespace esim {
namespace {

constexpr int kWidth = 7, kHeight = 5;
constexpr TimeSpan kSpan{1'000'000, 11'000'000};

/// Events at random pixels and times, in order.
std::vector<Event> random_events(std::size_t count) {
  const AddressedRandom random(3, Purpose::test);
  std::vector<Event> events(count);
  for (std::size_t i = 0; i < count; ++i) {
    const auto [a, b, c, d] = random.bits(static_cast<std::uint32_t>(i));
    events[i] = {kSpan.start + static_cast<TimeNs>(a % (kSpan.end - kSpan.start + 1)),
                 static_cast<std::uint16_t>(b % kWidth), static_cast<std::uint16_t>(c % kHeight),
                 static_cast<std::int8_t>(d % 2 == 0 ? 1 : -1)};
  }
  std::sort(events.begin(), events.end());
  return events;
}

template <typename T>
T at(const ImageStack<T>& stack, int image, int x, int y) {
  return stack.values[static_cast<std::size_t>((image * stack.height + y) * stack.width + x)];
}

TEST(EventCount, CountsPerPixelAndPolarity) {
  const std::vector<Event> events{{1, 2, 3, 1}, {2, 2, 3, 1}, {3, 2, 3, -1}, {4, 6, 4, -1}};
  const auto counts = count_events(events, kWidth, kHeight);
  EXPECT_EQ(at(counts, 0, 2, 3), 2);
  EXPECT_EQ(at(counts, 1, 2, 3), 1);
  EXPECT_EQ(at(counts, 1, 6, 4), 1);
  EXPECT_EQ(std::accumulate(counts.values.begin(), counts.values.end(), 0), 4);
}

TEST(EventCount, RefusesWhatIsOutsideAndSizesThatAreNone) {
  const std::vector<Event> events{{1, 6, 4, 1}, {2, 7, 0, 1}};
  EXPECT_TRUE(test::contains(test::message_of<UserError>([&] { count_events(events, kWidth, kHeight); }),
                             "event 1: x = 7, y = 0"));
  EXPECT_THROW(count_events({}, 0, 5), UserError);
  EXPECT_THROW(count_events({}, 5, 100000), UserError);
  EXPECT_THROW(voxel_grid({}, 5, 5, 0, kSpan), UserError);
  EXPECT_THROW(voxel_grid({}, 5, 5, 3, {2, 1}), UserError);
}

TEST(CountAndStamp, HasTheLastAndTheMeanTime) {
  const std::vector<Event> events{{0, 0, 0, 1},          {kSpan.start, 1, 1, 1},  {kSpan.start + 2'500'000, 1, 1, 1},
                                  {kSpan.end, 1, 1, -1}, {kSpan.start, 2, 1, -1}, {kSpan.end + 1, 0, 0, 1}};
  const auto last = count_and_stamp(events, kWidth, kHeight, kSpan, StampChoice::last);
  const auto mean = count_and_stamp(events, kWidth, kHeight, kSpan, StampChoice::mean);
  for (const auto& tensor : {last, mean}) {
    EXPECT_EQ(at(tensor, 0, 0, 0), 0);  // outside the span
    EXPECT_EQ(at(tensor, 0, 1, 1), 2);
    EXPECT_EQ(at(tensor, 1, 1, 1), 1);
    EXPECT_EQ(at(tensor, 3, 1, 1), 1);
    EXPECT_EQ(at(tensor, 3, 2, 1), 0);
    EXPECT_EQ(at(tensor, 2, 5, 3), 0);
  }
  EXPECT_FLOAT_EQ(at(last, 2, 1, 1), 0.25F);
  EXPECT_FLOAT_EQ(at(mean, 2, 1, 1), 0.125F);
}

TEST(VoxelGrid, IsTheSumOfItsKernels) {
  const std::vector<Event> events = random_events(500);
  for (const int bins : {1, 2, 5}) {
    const auto grid = voxel_grid(events, kWidth, kHeight, bins, kSpan);
    std::vector<double> slow(grid.values.size(), 0.0);
    for (const Event& event : events) {
      const double position = (bins - 1) * static_cast<double>(event.t - kSpan.start) / (kSpan.end - kSpan.start);
      for (int b = 0; b < bins; ++b) {
        slow[static_cast<std::size_t>((b * kHeight + event.y) * kWidth + event.x)] +=
            event.polarity * std::max(0.0, 1 - std::fabs(b - position));
      }
    }
    for (std::size_t i = 0; i < slow.size(); ++i) EXPECT_NEAR(grid.values[i], slow[i], 1e-5) << "bins " << bins;
  }
}

TEST(VoxelGrid, KeepsThePolarityOfEveryEvent) {
  const std::vector<Event> events = random_events(500);
  double polarity = 0;
  for (const Event& event : events) polarity += event.polarity;
  const auto grid = voxel_grid(events, kWidth, kHeight, 9, kSpan);
  EXPECT_NEAR(std::accumulate(grid.values.begin(), grid.values.end(), 0.0), polarity, 1e-3);
}

TEST(VoxelGrid, OfAnInstantIsInTheFirstBin) {
  const std::vector<Event> events{{5, 1, 1, 1}, {5, 1, 1, 1}};
  const auto grid = voxel_grid(events, kWidth, kHeight, 3, {5, 5});
  EXPECT_EQ(at(grid, 0, 1, 1), 2);
  EXPECT_EQ(std::accumulate(grid.values.begin(), grid.values.end(), 0.0), 2);
}

TEST(Standardise, LeavesZerosAndGivesUnitDeviation) {
  std::vector<float> values{0, 1, 5, 0, -3, 2};
  standardise(values);
  EXPECT_EQ(values[0], 0);
  EXPECT_EQ(values[3], 0);
  double sum = 0, squares = 0;
  for (const float value : values) sum += value, squares += value * value;
  EXPECT_NEAR(sum, 0, 1e-6);
  EXPECT_NEAR(squares / 4, 1, 1e-6);

  std::vector<float> same{2, 0, 2};
  standardise(same);
  EXPECT_EQ(same, (std::vector<float>{0, 0, 0}));
}

TEST(TimeSurface, DecaysFromTheLastEvent) {
  const std::vector<Event> events{{0, 1, 1, 1}, {10'000'000, 1, 1, 1}, {20'000'000, 1, 1, -1}, {40'000'000, 1, 1, 1}};
  const auto surface = time_surface(events, kWidth, kHeight, 30'000'000, 0.01);
  EXPECT_NEAR(at(surface, 0, 1, 1), std::exp(-2.0), 1e-6);
  EXPECT_NEAR(at(surface, 1, 1, 1), std::exp(-1.0), 1e-6);
  EXPECT_EQ(at(surface, 0, 0, 0), 0);
  EXPECT_THROW(time_surface(events, kWidth, kHeight, 0, 0), UserError);
}

TEST(EventFrame, ShowsTheLastEvent) {
  const FramePalette palette{{1, 2, 3}, {4, 5, 6}, {7, 8, 9}};
  const std::vector<Event> events{{0, 1, 0, 1}, {1, 1, 0, -1}, {2, 2, 0, 1}};
  const auto frame = event_frame(events, kWidth, kHeight, palette);
  ASSERT_EQ(frame.size(), std::size_t{3 * kWidth * kHeight});
  EXPECT_EQ((std::vector<std::uint8_t>{frame.begin(), frame.begin() + 9}),
            (std::vector<std::uint8_t>{7, 8, 9, 4, 5, 6, 1, 2, 3}));
}

}  // namespace
}  // namespace esim
