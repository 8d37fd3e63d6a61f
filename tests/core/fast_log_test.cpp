#include "esim/core/fast_log.h"

#include <gtest/gtest.h>

#include <cmath>

namespace esim {
namespace {

TEST(FastLog, IsWithinItsBoundAndMonotone) {
  float last = fast_log2(1e-30F);
  for (float x = 1e-30F; x < 1e30F; x *= 1.0007F) {
    const float y = fast_log2(x);
    EXPECT_NEAR(y, std::log2(double{x}), 3e-6 + 1.2e-7 * std::fabs(std::log2(x))) << x;
    EXPECT_GE(y, last);
    last = y;
    EXPECT_NEAR(fast_log(x), std::log(double{x}), 3e-6 + 2e-7 * std::fabs(std::log(x)));
  }
  EXPECT_EQ(fast_log2(8.0F), 3.0F);
}

}  // namespace
}  // namespace esim
