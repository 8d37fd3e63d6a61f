#include "esim/video/model_process.h"

#include <gtest/gtest.h>
#include <stdlib.h>

#include <filesystem>
#include <fstream>

#include "esim/core/error.h"
#include "support/errors.h"
#include "support/temporary_directory.h"

namespace esim {
namespace {

/// A program in place of Python, in the shell. Its input is a socket, to which it can also write.
class ModelProcessTest : public testing::Test {
 protected:
  ModelProcessTest() { std::ofstream(model_) << "a model"; }
  ~ModelProcessTest() override { ::unsetenv("ESIM_PYTHON"); }

  void use_python(const std::string& script) {
    const std::filesystem::path program = directory_.path() / "python";
    std::ofstream(program) << "#!/bin/sh\n" << script << "\n";
    std::filesystem::permissions(program, std::filesystem::perms::owner_all);
    ::setenv("ESIM_PYTHON", program.c_str(), 1);
  }
  std::unique_ptr<FrameInterpolator> start() const { return start_model_process(model_, 3, 2, false); }
  std::string refusal() const {
    return test::message_of<UserError>([&] { start(); });
  }

  const Frame frame0_{0, {Image<float>(3, 2, 0.25F)}}, frame1_{1000, {Image<float>(3, 2, 0.75F)}};
  test::TemporaryDirectory directory_;
  std::filesystem::path model_ = directory_.path() / "model.onnx";
};

constexpr const char* kReady = R"(printf '\0\0\0\0' >&0)";
constexpr const char* kTakeRequest = "head -c 56 > request";  // a fraction, and two frames of 6 pixels

TEST_F(ModelProcessTest, SendsFramesAndReceivesImages) {
  use_python(std::string(kReady) + "; cd " + directory_.path().string() + "; " + kTakeRequest +
             R"(; printf '\0\0\0\0' >&0; tail -c 24 request >&0)");  // returns frame 1
  const auto interpolator = start();
  EXPECT_TRUE(test::contains(interpolator->name(), "model.onnx"));
  Planes light;
  interpolator->between(frame0_, frame1_, 0.5, light);
  ASSERT_EQ(light.size(), 1u);
  EXPECT_EQ(light[0].width(), 3);
  for (const float value : light[0].pixels()) EXPECT_EQ(value, 0.75F);
  std::ifstream request(directory_.path() / "request", std::ios::binary);
  double fraction = 0;
  request.read(reinterpret_cast<char*>(&fraction), sizeof(fraction));
  EXPECT_EQ(fraction, 0.5);
  // It has ended since.
  const std::string problem =
      test::message_of<UserError>([&] { interpolator->between(frame0_, frame1_, 0.75, light); });
  EXPECT_TRUE(test::contains(problem, "its process")) << problem;
}

TEST_F(ModelProcessTest, PassesErrorsOn) {
  use_python(R"(printf '\011\0\0\0too small' >&0)");
  EXPECT_EQ(refusal(), "too small");
  use_python(std::string(kReady) + "; cd " + directory_.path().string() + "; " + kTakeRequest +
             R"(; printf '\011\0\0\0too small' >&0; sleep 60)");
  const auto interpolator = start();
  Planes light;
  EXPECT_EQ(test::message_of<UserError>([&] { interpolator->between(frame0_, frame1_, 0.5, light); }), "too small");
}

TEST_F(ModelProcessTest, SaysWhatIsMissing) {
  use_python("exit 3");
  EXPECT_TRUE(test::contains(refusal(), "ended with exit status 3 before it was ready; models need a Python with"));
  use_python("kill -9 $$");
  EXPECT_TRUE(test::contains(refusal(), "ended by signal 9"));
  ::setenv("ESIM_PYTHON", "/none/python", 1);
  EXPECT_TRUE(test::contains(refusal(), "/none/python was not found; models need a Python with"));
  std::filesystem::remove(model_);
  EXPECT_TRUE(test::contains(refusal(), "model.onnx: no such file"));
}

}  // namespace
}  // namespace esim
