#pragma once

#include <gtest/gtest.h>

#include "render/scenes.h"

namespace esim::test {

/// (name of the renderer, kind of distortion)
class EveryRenderer : public testing::TestWithParam<std::tuple<const char*, int>> {
 public:
  static std::string name(const testing::TestParamInfo<std::tuple<const char*, int>>& test) {
    const char* distortions[] = {"none", "radtan", "equidistant", "fov"};
    return std::string(std::get<0>(test.param)) + "_" + distortions[std::get<1>(test.param)];
  }

  void SetUp() override {
    if (name_.ends_with("gl") && !has_gl()) GTEST_SKIP() << "no OpenGL: libegl1, libgl1-mesa-dri";
    renderer_ = make(two_threads());
  }

 protected:
  virtual std::unique_ptr<Renderer> make(const Workers& workers) const { return make_renderer(name_, model_, workers); }

  /// The sample of moving_camera() and moving_objects() `dt` seconds later.
  RenderRequest view(double dt) const {
    return {kTime + to_ns(dt), moving_camera(dt), {{0, 0, model_.width, model_.height}}, objects_of(name_, dt)};
  }

  const Camera model_ = distorted_camera(std::get<1>(GetParam()));
  const std::string name_ = std::get<0>(GetParam());
  std::unique_ptr<Renderer> renderer_;
};

}  // namespace esim::test
