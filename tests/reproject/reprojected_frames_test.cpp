#include "esim/reproject/frames/reprojected_frames.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "esim/core/error.h"
#include "esim/geometry/so3.h"
#include "esim/reproject/frames/object_motion.h"
#include "render/scenes.h"

namespace esim {
namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

enum class Given { poses, motion, motion_and_objects };

/// Frames of the test scene with two moving objects, at times `dt` in seconds.
class Frames {
 public:
  explicit Frames(int supersampling, int distortion = 0)
      : layout_(lay_out_keyframes(test::distorted_camera(distortion), supersampling, supersampling > 1 ? 4 : 0)),
        renderer_(test::make_renderer("moving_raster", layout_.camera)) {}

  const KeyframeLayout& layout() const { return layout_; }

  PosedFrame at(double dt) const {
    const Camera& camera = layout_.camera;
    Sample sample = test::render(*renderer_, camera, test::moving_camera(dt), test::moving_objects(dt), {}, dt);
    PosedFrame frame;
    frame.t = sample.t;
    frame.T_world_camera = test::moving_camera(dt).T_world_body;
    for (const Kinematics& object : test::moving_objects(dt)) frame.T_world_objects.push_back(object.T_world_body);
    frame.irradiance = std::move(sample.irradiance), frame.depth = std::move(sample.depth);
    frame.object = std::move(sample.object);
    return frame;
  }

  /// A frame with what a caller gives of the motion since an earlier time.
  PosedFrame at(double dt, double earlier, Given given) const {
    PosedFrame frame = at(dt);
    if (given == Given::poses) return frame;
    frame.motion_x = frame.motion_y = Image<float>(frame.depth.width(), frame.depth.height());
    const PosedFrame before = at(earlier);
    const PixelRays rays(layout_.camera);
    for (int y = 0; y < frame.depth.height(); ++y) {
      for (int x = 0; x < frame.depth.width(); ++x) {
        const double z = frame.depth(x, y);
        const Eigen::Vector3d point = frame.T_world_camera * Eigen::Vector3d(z * rays.x(x, y), z * rays.y(x, y), z);
        const std::size_t object = frame.object(x, y);
        const Eigen::Vector3d then =
            object == 0 ? point
                        : before.T_world_objects[object - 1] * (frame.T_world_objects[object - 1].inverse() * point);
        const auto seen = layout_.camera.project(before.T_world_camera.inverse() * then);
        frame.motion_x(x, y) = seen ? static_cast<float>(x - seen->pixel.x()) : kNaN;
        frame.motion_y(x, y) = seen ? static_cast<float>(y - seen->pixel.y()) : kNaN;
      }
    }
    frame.T_world_objects.clear();
    if (given == Given::motion) frame.object = {};
    return frame;
  }

  /// What the sensor sees: means over its pixels.
  Image<float> seen(double dt) const {
    const Image<float> irradiance = at(dt).irradiance;
    const int s = layout_.supersampling, margin = s * layout_.margin_px;
    Image<float> mean(layout_.sensor.width, layout_.sensor.height);
    for (int y = 0; y < s * mean.height(); ++y) {
      for (int x = 0; x < s * mean.width(); ++x)
        mean(x / s, y / s) += irradiance(margin + x, margin + y) / static_cast<float>(s * s);
    }
    return mean;
  }

 private:
  KeyframeLayout layout_;
  std::unique_ptr<Renderer> renderer_;
};

double rms(const Image<float>& a, const Image<float>& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += std::pow(a.pixels()[i] - b.pixels()[i], 2);
  return std::sqrt(sum / static_cast<double>(a.size()));
}

/// A segment with copies of its images.
struct Piece {
  TimeNs t0, t1;
  Image<float> irradiance0, irradiance1;
};

Image<float> copy(const ImageView<float>& view, const Tile& tile) {
  Image<float> image(tile.width, tile.height);
  for (int y = 0; y < tile.height; ++y) std::copy_n(view.row(y), tile.width, image.row(y));
  return image;
}

std::vector<Piece> take(ReprojectedFrames& frames, PosedFrame frame) {
  std::vector<Piece> pieces;
  frames.take(std::move(frame), [&](const Segment& segment) {
    pieces.push_back(
        {segment.t0, segment.t1, copy(segment.irradiance0, segment.tile), copy(segment.irradiance1, segment.tile)});
  });
  return pieces;
}

class AnyMotion : public testing::TestWithParam<std::tuple<int, int, Given>> {};

TEST_P(AnyMotion, FillsTheTimeBetweenFrames) {
  const auto [supersampling, distortion, given] = GetParam();
  const Frames scene(supersampling, distortion);
  ReprojectedFrames frames(scene.layout(), {.lambda = 0.5}, test::two_threads());
  const std::vector<Piece> first = take(frames, scene.at(0));
  ASSERT_EQ(first.size(), 1U);
  EXPECT_EQ(first[0].t0, first[0].t1);
  double earlier = 0;
  for (const double dt : {0.02, 0.05}) {  // at different distances
    const std::vector<Piece> pieces = take(frames, scene.at(dt, earlier, given));
    ASSERT_GE(pieces.size(), 4U);
    // Contiguous, and exact at the times of the frames.
    EXPECT_EQ(pieces.front().t0, test::kTime + to_ns(earlier));
    EXPECT_EQ(pieces.back().t1, test::kTime + to_ns(dt));
    for (std::size_t i = 1; i < pieces.size(); ++i) {
      EXPECT_EQ(pieces[i].t0, pieces[i - 1].t1);
      EXPECT_EQ(rms(pieces[i].irradiance0, pieces[i - 1].irradiance1), 0);
    }
    const Image<float> begin = scene.seen(earlier), end = scene.seen(dt);
    EXPECT_LT(rms(pieces.front().irradiance0, begin), 1e-6);
    EXPECT_LT(rms(pieces.back().irradiance1, end), 1e-6);
    // In between much closer to the truth than linear interpolation is.
    const Piece& middle = pieces[pieces.size() / 2];
    const double t = to_seconds(middle.t0 - test::kTime);
    const auto share = static_cast<float>((t - earlier) / (dt - earlier));
    Image<float> linear = begin;
    for (std::size_t i = 0; i < linear.size(); ++i) linear.pixels()[i] += share * (end.pixels()[i] - begin.pixels()[i]);
    const Image<float> truth = scene.seen(t);
    EXPECT_LT(rms(middle.irradiance0, truth), 0.5 * rms(linear, truth)) << dt;
    earlier = dt;
  }
  EXPECT_EQ(frames.statistics().frames, 3);
  EXPECT_LT(frames.statistics().unseen, 0.03);
  if (given == Given::poses) return;
  EXPECT_EQ(frames.statistics().objects, 2);
  EXPECT_GT(frames.statistics().moving, 0.05);
  EXPECT_LT(frames.statistics().not_rigid, 0.001);
}

INSTANTIATE_TEST_SUITE_P(Motions, AnyMotion,
                         testing::Combine(testing::Values(1, 2), testing::Values(0, 1, 2),
                                          testing::Values(Given::poses, Given::motion, Given::motion_and_objects)));

TEST(ReprojectedFrames, DoNotChangeAtRest) {
  const Frames scene(2);
  ReprojectedFrames frames(scene.layout(), {}, test::two_threads());
  PosedFrame frame = scene.at(0);
  take(frames, frame);
  frame.t += 1000000;
  const std::vector<Piece> pieces = take(frames, frame);
  ASSERT_EQ(pieces.size(), 1U);
  EXPECT_EQ(rms(pieces[0].irradiance0, pieces[0].irradiance1), 0);
}

TEST(ReprojectedFrames, DoNotDependOnThreads) {
  const Frames scene(2, 1);
  const Workers one(1);
  ReprojectedFrames a(scene.layout(), {}, one), b(scene.layout(), {}, test::two_threads());
  take(a, scene.at(0)), take(b, scene.at(0));
  const PosedFrame next = scene.at(0.03, 0, Given::motion);
  const std::vector<Piece> x = take(a, next), y = take(b, next);
  ASSERT_EQ(x.size(), y.size());
  for (std::size_t i = 0; i < x.size(); ++i) EXPECT_EQ(rms(x[i].irradiance1, y[i].irradiance1), 0);
}

TEST(ReprojectedFrames, TakeObjectsThatAppear) {
  const Frames scene(1);
  ReprojectedFrames frames(scene.layout(), {}, test::two_threads());
  PosedFrame without = scene.at(0);
  without.T_world_objects.clear(), without.object = {};
  take(frames, without);
  EXPECT_GE(take(frames, scene.at(0.02)).size(), 1U);
  EXPECT_GE(take(frames, scene.at(0.04)).size(), 1U);
}

TEST(ReprojectedFrames, RefuseWhatDoesNotFit) {
  const Frames scene(1);
  ReprojectedFrames frames(scene.layout(), {}, test::two_threads());
  take(frames, scene.at(0));
  const auto refuses = [&](const auto& change) {
    PosedFrame frame = scene.at(0.01);
    change(frame);
    EXPECT_THROW(take(frames, std::move(frame)), UserError);
  };
  refuses([](PosedFrame& f) { f.t = test::kTime; });
  refuses([](PosedFrame& f) { f.irradiance = Image<float>(4, 4); });
  refuses([](PosedFrame& f) { f.irradiance(3, 3) = kNaN; });
  refuses([](PosedFrame& f) { f.irradiance(3, 3) = -1; });
  refuses([](PosedFrame& f) { f.depth = {}; });
  refuses([](PosedFrame& f) { f.object = Image<std::uint16_t>(2, 2); });
  refuses([](PosedFrame& f) { f.object(5, 5) = 3; });
  refuses([](PosedFrame& f) { f.T_world_objects.pop_back(); });
  refuses([](PosedFrame& f) { f.motion_x = f.motion_y = Image<float>(2, 2); });
  EXPECT_GE(take(frames, scene.at(0.01)).size(), 1U);  // the refused ones had no effect
}

// Damaged motion vectors and depth give some image, in bounded time.
TEST(ReprojectedFrames, BearDamagedImages) {
  const Frames scene(1);
  ReprojectedFrames frames(scene.layout(), {}, test::two_threads());
  take(frames, scene.at(0));
  PosedFrame frame = scene.at(0.02, 0, Given::motion);
  const std::array<float, 6> wrong = {kNaN, 0, -1, 1e30F, std::numeric_limits<float>::infinity(), 1e-30F};
  for (std::size_t i = 0; i < frame.depth.size(); ++i) {
    if (i % 7 == 0) frame.depth.pixels()[i] = wrong[i / 7 % wrong.size()];
    if (i % 5 == 0) frame.motion_x.pixels()[i] = wrong[i / 5 % wrong.size()];
    if (i % 11 == 0) frame.motion_y.pixels()[i] = wrong[i / 11 % wrong.size()];
  }
  for (const Piece& piece : take(frames, frame)) {
    for (const float e : piece.irradiance1.pixels()) ASSERT_TRUE(e >= 0 && std::isfinite(e));
  }
}

TEST(ObjectMotion, FindsPosesAndLabels) {
  for (const int distortion : {0, 2}) {
    const Frames scene(1, distortion);
    const PosedFrame then = scene.at(0), now = scene.at(0.02, 0, Given::motion), labelled = scene.at(0.02);
    const PixelRays rays(scene.layout().camera);
    const ObjectMotions found = find_object_motions(scene.layout(), rays, then, now, test::two_threads());
    ASSERT_EQ(found.now.size(), 2U);
    const auto agreement = [](const Image<std::uint16_t>& told, const Image<std::uint16_t>& truth) {
      int same = 0;
      for (std::size_t i = 0; i < told.size(); ++i) same += (told.pixels()[i] > 0) == (truth.pixels()[i] > 0);
      return static_cast<double>(same) / static_cast<double>(told.size());
    };
    // Some parts of the objects move as if they were static, within a quarter of a pixel.
    EXPECT_GT(agreement(found.object_now, labelled.object), 0.96);
    EXPECT_GT(agreement(found.object_then, then.object), 0.93);
    for (std::size_t i = 0; i < 2; ++i) {
      // Which of the two it is.
      const Eigen::Vector3d at = found.now[i].translation;
      const std::size_t k =
          (at - labelled.T_world_objects[0].translation).norm() < (at - labelled.T_world_objects[1].translation).norm()
              ? 0
              : 1;
      const SE3 moved = then.T_world_objects[k] * labelled.T_world_objects[k].inverse() * found.now[i];
      EXPECT_LT((found.then[i].translation - moved.translation).norm(), 1e-3);
      EXPECT_LT(so3_log(found.then[i].rotation.conjugate() * moved.rotation).norm(), 5e-3);
    }
  }
}

TEST(PosePath, IsExactForConstantAccelerations) {
  const auto pose = [](double t) {
    return SE3{so3_exp({0.3 * t, -0.2 * t, 0.1}), {1 + 2 * t - 3 * t * t, 0.5 * t * t, -t}};
  };
  const auto at = [&](double t) { return PoseAt{to_ns(t), pose(t)}; };
  const PosePath quadratic(at(0.1), at(0.4), at(0.5)), uniform(at(0.4), at(0.5));
  for (const double t : {0.4, 0.43, 0.5}) {
    EXPECT_LT((quadratic.at(to_ns(t)).translation - pose(t).translation).norm(), 1e-9) << t;
  }
  EXPECT_LT((uniform.at(to_ns(0.45)).translation - 0.5 * (pose(0.4).translation + pose(0.5).translation)).norm(),
            1e-12);
  // A rotation about a fixed axis at a changing rate.
  const auto turned = [](double t) {
    return PoseAt{to_ns(t), {so3_exp(Eigen::Vector3d(0, 0, 2 * t + 3 * t * t)), {0, 0, 0}}};
  };
  const PosePath turning(turned(0), turned(0.1), turned(0.15));
  EXPECT_LT(so3_log(turning.at(to_ns(0.12)).rotation.conjugate() * turned(0.12).pose.rotation).norm(), 1e-8);
}

}  // namespace
}  // namespace esim
