#include "esim/scenario/sampling_text.h"

#include <gtest/gtest.h>

#include "esim/core/error.h"
#include "support/errors.h"

namespace esim {
namespace {

std::string refusal(const std::string& text) {
  return test::message_of<UserError>([&] { read_sampling(text); });
}

TEST(SamplingText, ReadsWordsAndMaps) {
  for (const char* text : {"flow lambda=0.7 max_rate_hz=1e4", "{type: flow, lambda: 0.7, max_rate_hz: 1e4}"}) {
    const auto options = std::get<FlowSampling>(read_sampling(text));
    EXPECT_EQ(options.lambda, 0.7);
    EXPECT_EQ(options.bounds.max_rate_hz, 1e4);
    EXPECT_EQ(options.bounds.min_rate_hz, RateBounds{}.min_rate_hz);
  }
  EXPECT_EQ(std::get<UniformSampling>(read_sampling("uniform")).rate_hz, UniformSampling{}.rate_hz);
}

TEST(SamplingText, ReadsBackWhatItWrites) {
  EXPECT_EQ(sampling_text(FlowSampling{0.5, {}}), "flow lambda=0.5");
  EXPECT_EQ(sampling_text(FlowSampling{0.5, {10, 50000}}), "flow lambda=0.5 min_rate_hz=10");
  EXPECT_EQ(sampling_family(FlowSampling{0.25, {10, 50000}}), "flow min_rate_hz=10");
  EXPECT_EQ(sampling_family(UniformSampling{77}), "uniform");
  for (const std::string& type : sampling_types()) {
    const std::string text = sampling_text(read_sampling(type));
    EXPECT_TRUE(text.starts_with(type + " ")) << text;
    EXPECT_EQ(sampling_text(read_sampling(text)), text);
  }
}

TEST(SamplingText, SaysWhatIsWrong) {
  EXPECT_TRUE(test::contains(refusal("flwo"), "did you mean flow?"));
  EXPECT_TRUE(test::contains(refusal("flow lamda=1"), "did you mean lambda?"));
  EXPECT_TRUE(test::contains(refusal("flow 0.5"), "key=value"));
  EXPECT_TRUE(test::contains(refusal("flow lambda=-1"), "out of range"));
  EXPECT_TRUE(test::contains(refusal("{type: flow, lambda: 1"), "not valid YAML"));
  EXPECT_TRUE(test::contains(refusal(""), "scheme"));
}

}  // namespace
}  // namespace esim
