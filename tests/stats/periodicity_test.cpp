#include "esim/stats/periodicity.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "stats/streams.h"

namespace esim {
namespace {

using test::banded;
using test::poisson_times;

std::vector<TimeNs> in_whole_microseconds(std::vector<TimeNs> times) {
  for (TimeNs& t : times) t -= t % kNsPerUs;
  return times;
}

// Bursts of ten events within half a millisecond, at a rate that triples and falls again.
std::vector<TimeNs> bursts(unsigned seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> uniform(0, 1);
  std::vector<TimeNs> times;
  for (const TimeNs start : poisson_times(3000, 4, seed)) {
    const double rate = 1 / 3.0 + 2 / 3.0 * std::pow(std::sin(to_seconds(start) * 0.8), 2);
    if (uniform(random) > rate) continue;
    for (int i = 0; i < 10; ++i) times.push_back(start + to_ns(5e-4 * uniform(random)));
  }
  std::sort(times.begin(), times.end());
  return times;
}

TEST(PhaseTest, StatisticsByBruteForce) {
  const auto times = poisson_times(5e4, 2, 1);
  const PhaseTest test = test_phase(times, 29.97);
  std::array<double, PhaseTest::kBins> histogram{};
  for (const TimeNs t : times) {
    const double turns = to_seconds(t) * 29.97;
    ++histogram[static_cast<std::size_t>((turns - std::floor(turns)) * PhaseTest::kBins)];
  }
  double chi2 = 0;
  const double expected = static_cast<double>(times.size()) / PhaseTest::kBins;
  for (std::size_t i = 0; i < histogram.size(); ++i) {
    EXPECT_EQ(histogram[i], static_cast<double>(test.histogram[i]));
    chi2 += (histogram[i] - expected) * (histogram[i] - expected) / expected;
  }
  EXPECT_NEAR(test.chi2_per_dof, chi2 / 63, 1e-9);
  EXPECT_NEAR(test.periods, 2 * 29.97, 0.01);
  EXPECT_NEAR(test.fraction_at_peak, 0.02, 0.003);
}

// Without periodicity, p is uniform on [0, 1].
TEST(PhaseTest, PoissonStreamsAreNotFlagged) {
  constexpr int kSeeds = 200;
  int below_1_percent = 0, below_half = 0;
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    const PhaseTest test = test_phase(poisson_times(1e4, 1.5, seed), 60);
    below_1_percent += test.p_value < 0.01 ? 1 : 0;
    below_half += test.p_value < 0.5 ? 1 : 0;
    EXPECT_EQ(test.banding, Banding::none) << seed;
  }
  EXPECT_LT(below_1_percent, kSeeds / 20);
  EXPECT_NEAR(below_half, kSeeds / 2, 4 * std::sqrt(kSeeds / 4));
}

TEST(PhaseTest, BurstsAndChangingRatesAreNotFlagged) {
  int below_1_percent = 0;
  for (unsigned seed = 1; seed <= 100; ++seed) {
    const PhaseTest test = test_phase(bursts(seed), 30);
    EXPECT_GT(test.neighbours_chi2_per_dof, 2) << "the bursts should matter";
    EXPECT_EQ(test.banding, Banding::none) << seed;
    below_1_percent += test.p_value < 0.01 ? 1 : 0;
  }
  EXPECT_LT(below_1_percent, 10);
}

TEST(PhaseTest, EvenStreamsAreNotFlagged) {
  std::vector<TimeNs> every_10_us;
  for (TimeNs t = 0; t < kNsPerSecond; t += 10'007) every_10_us.push_back(t);
  EXPECT_EQ(test_phase(every_10_us, 30).banding, Banding::none);
  // At 1 kHz a bin is 15.6 us wide: bins hold 15 or 16 different stamps.
  EXPECT_EQ(test_phase(in_whole_microseconds(poisson_times(1e6, 1, 7)), 1000).banding, Banding::none);
}

TEST(PhaseTest, BandsAreFlagged) {
  for (const int stamps : {1, 3, 10}) {
    std::vector<TimeNs> times = banded(poisson_times(2e4, 2, 1), 30, stamps);
    for (TimeNs& t : times) t += 5'100'000;  // away from the borders of bins
    const PhaseTest test = test_phase(in_whole_microseconds(times), 30);
    EXPECT_EQ(test.banding, Banding::strong) << stamps;
    EXPECT_LT(test.p_value, 1e-100) << stamps;
    EXPECT_NEAR(test.fraction_at_peak, 1.0 / stamps, 0.02) << stamps;
    EXPECT_NEAR(test.modulation, std::sqrt(64.0 / stamps - 1), 0.1) << stamps;
  }
  // One in 200 events at the frames: rms of at most sqrt(64) / 200 = 4 %.
  std::vector<TimeNs> weak = poisson_times(1e5, 4, 1);
  const std::vector<TimeNs> moved = banded(weak, 25, 1);
  for (std::size_t i = 0; i < weak.size(); i += 200) weak[i] = moved[i];
  std::sort(weak.begin(), weak.end());
  EXPECT_EQ(test_phase(weak, 25).banding, Banding::weak);
}

TEST(PhaseTest, TooLittleToTell) {
  EXPECT_EQ(test_phase({}, 30).banding, Banding::unknown);
  EXPECT_EQ(test_phase(banded(poisson_times(1e5, 0.5, 1), 30, 1), 30).banding, Banding::unknown);
  EXPECT_EQ(test_phase(poisson_times(50, 1, 1), 500).banding, Banding::unknown);
}

TEST(FindPeriodicity, NothingInPoissonStreamsAndBursts) {
  int below_1_percent = 0;
  for (unsigned seed = 1; seed <= 200; ++seed) {
    const auto found = find_periodicity(poisson_times(1e3, 2, seed));
    ASSERT_TRUE(found);
    EXPECT_FALSE(found->found()) << seed;
    below_1_percent += found->p_value < 0.01 ? 1 : 0;
  }
  EXPECT_LT(below_1_percent, 10);
  for (unsigned seed = 1; seed <= 10; ++seed) EXPECT_FALSE(find_periodicity(bursts(seed))->found()) << seed;
}

TEST(FindPeriodicity, TheFrameRate) {
  for (const double frame_rate_hz : {24.0, 29.97, 61.3, 240.0, 1000.0}) {
    const auto found = find_periodicity(in_whole_microseconds(banded(poisson_times(2e4, 3, 1), frame_rate_hz, 1)));
    ASSERT_TRUE(found);
    EXPECT_TRUE(found->found());
    EXPECT_NEAR(found->frequency_hz, frame_rate_hz, 0.005) << frame_rate_hz;
  }
}

// For stamps at 1/5, 2/5, 3/5 of the frame, the strongest frequency is not the frame rate.
TEST(FindPeriodicity, UnevenStampsInAFrame) {
  std::mt19937 random(1);
  std::vector<TimeNs> times = banded(poisson_times(2e4, 4, 1), 30, 1);
  for (TimeNs& t : times) t += to_ns(static_cast<double>(random() % 3) / 5 / 30);
  std::sort(times.begin(), times.end());
  EXPECT_NEAR(find_periodicity(times)->frequency_hz, 30, 0.005);
}

TEST(FindPeriodicity, LongAndShortRecordings) {
  std::vector<TimeNs> slow = banded(poisson_times(20, 3000, 1), 50, 1);
  EXPECT_NEAR(find_periodicity(slow)->frequency_hz, 50, 1e-4);
  EXPECT_FALSE(find_periodicity(poisson_times(1e6, 0.005, 1)));
  EXPECT_FALSE(find_periodicity({}));
  EXPECT_FALSE(find_periodicity(std::vector<TimeNs>(500, 3)));
}

}  // namespace
}  // namespace esim
