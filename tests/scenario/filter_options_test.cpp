#include <gtest/gtest.h>

#include "esim/core/error.h"
#include "esim/scenario/filter_options.h"
#include "support/errors.h"

namespace esim {
namespace {

using test::contains;
using test::message_of;

std::string problem(const std::vector<std::string>& options) {
  return message_of<UserError>([&] { read_filters(options, "filter "); });
}

TEST(ReadFilters, UsesTheFiltersThatAreNamed) {
  const FilterOptions none = read_filters({});
  EXPECT_FALSE(none.region || none.activity || none.anti_flicker || none.trail || none.rate_controller);
  const FilterOptions some =
      read_filters({"trail={}", "anti_flicker.low_hz=90", "anti_flicker.mode=band_pass",
                    "region={windows: [{x: 1, y: 2, width: 3, height: 4}], masked_pixels: [{x: 5, y: 6}]}"});
  ASSERT_TRUE(some.region && some.anti_flicker && some.trail);
  EXPECT_FALSE(some.activity || some.rate_controller);
  EXPECT_EQ(some.trail->threshold_us, TrailFilterOptions{}.threshold_us);
  EXPECT_EQ(some.anti_flicker->low_hz, 90);
  EXPECT_EQ(some.anti_flicker->mode, FlickerMode::band_pass);
  EXPECT_EQ(some.region->windows.at(0).height, 4);
  EXPECT_EQ(some.region->masked_pixels.at(0).y, 6);
}

TEST(ReadFilters, NamesTheOptionThatIsWrong) {
  EXPECT_EQ(problem({"trail.threshold_us=0"}),
            "filter trail.threshold_us: 0 is out of range: must be at least 1 us and at most 10000000 us");
  EXPECT_TRUE(contains(problem({"trail.treshold_us=5"}), "did you mean threshold_us?"));
  EXPECT_TRUE(contains(problem({"trails={}"}), "did you mean trail?"));
  EXPECT_TRUE(contains(problem({"trail.type=stc_cut"}), "stc_cut_trail"));
  EXPECT_TRUE(contains(problem({"trail=5"}), "trail: must be a map"));
  EXPECT_TRUE(contains(problem({"region.windows=[{x: 0, y: 0, width: 0, height: 1}]"}), "region.windows.0.width"));
  EXPECT_TRUE(contains(problem({"anti_flicker.low_hz=600"}), "anti_flicker.low_hz: must be below high_hz"));
  EXPECT_TRUE(contains(problem({"activity={}"}), "activity: has no bound"));
}

}  // namespace
}  // namespace esim
