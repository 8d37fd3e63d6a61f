// Intervals of 200 sensors contain the truth as often as they say.
#include <gtest/gtest.h>

#include <cstdio>

#include "fit/known_sensors.h"

namespace esim {
namespace {

TEST(Fit, IntervalsContainTheTruth) {
  for (const test::Coverage& c : test::fit_random_sensors(200)) {
    std::printf("%-24s %d of %d, width %.2f, worst %.4f\n", c.name, c.inside, c.sensors, c.relative_width(), c.worst);
    EXPECT_GE(c.inside, 181) << c.name;  // binomial: 190 and 3 standard deviations of 3.1
    EXPECT_LE(c.inside, 199) << c.name;
    EXPECT_LE(c.relative_width(), 1.3) << c.name;
  }
}

}  // namespace
}  // namespace esim
