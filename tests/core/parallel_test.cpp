#include "esim/core/parallel.h"

#include <gtest/gtest.h>

#include <atomic>
#include <stdexcept>
#include <vector>

namespace esim {
namespace {

TEST(Workers, CallsTheBodyOnceForEachIndex) {
  for (const int threads : {1, 2, 5}) {
    const Workers workers(threads);
    EXPECT_EQ(workers.threads(), threads);
    std::vector<std::atomic<int>> calls(1000);
    workers.for_each(1000, [&](int i) { ++calls[static_cast<std::size_t>(i)]; });
    for (const auto& count : calls) EXPECT_EQ(count, 1);
  }
}

TEST(Workers, ZeroThreadsMeansAllProcessors) { EXPECT_GE(Workers(0).threads(), 1); }

TEST(Workers, DoesNothingForNothing) {
  Workers(2).for_each(0, [](int) { FAIL(); });
}

TEST(Workers, PassesExceptionsOn) {
  for (const int threads : {1, 2}) {
    EXPECT_THROW(Workers(threads).for_each(100,
                                           [](int i) {
                                             if (i == 57) throw std::runtime_error("x");
                                           }),
                 std::runtime_error);
  }
}

}  // namespace
}  // namespace esim
