// Ground truth from the scenario to the sink.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "sim/card_scene.h"

namespace esim {
namespace {

/// Keeps what ground truth says.
class Collector final : public Sink {
 public:
  struct Frame {
    int camera;
    TimeNs t;
    SE3 T_world_camera;
    Image<float> depth, motion_x;
    Image<std::uint16_t> object;
    std::vector<SE3> T_world_objects;
  };
  struct Interval {
    TimeNs t0, t1;
    Image<float> x, y;
    Image<std::uint8_t> visible;
  };

  void begin(const RecordingInfo& recording) override { info = recording; }
  void write(const Record& record) override {
    if (const auto* truth = std::get_if<TruthRecord>(&record)) {
      frames.push_back({truth->camera, truth->t, truth->T_world_camera, truth->depth, truth->motion_x, {}, {}});
      frames.back().T_world_objects.assign(truth->T_world_objects.begin(), truth->T_world_objects.end());
      if (truth->object != nullptr) frames.back().object = *truth->object;
    }
    if (const auto* part = std::get_if<OpticalFlowRecord>(&record)) {
      EXPECT_EQ(part->t1, frames.back().t);
      intervals.push_back({part->t0, part->t1, part->x, part->y, part->visible});
    }
    if (const auto* part = std::get_if<EventsRecord>(&record))
      events.insert(events.end(), part->events.begin(), part->events.end());
    if (const auto* part = std::get_if<EventPointsRecord>(&record)) {
      EXPECT_EQ(part->events.size(), part->points.size());
      points.insert(points.end(), part->points.begin(), part->points.end());
    }
  }
  void end(bool) override {}

  RecordingInfo info;
  std::vector<Frame> frames;
  std::vector<Interval> intervals;
  std::vector<Event> events;
  std::vector<Eigen::Vector3f> points;
};

class GroundTruth : public test::CardScene {
 protected:
  GroundTruth() {
    scenario_.start_s = 0.4;
    scenario_.duration_s = 0.2;
    scenario_.truth.rate_hz = 100;
  }

  Collector run(int threads = 2) {
    Collector out;
    simulate_into(out, threads);
    return out;
  }
};

TEST_F(GroundTruth, IsWhatIsAskedForAndChangesNoEvent) {
  const Collector plain = run();
  EXPECT_TRUE(plain.intervals.empty() && plain.points.empty());
  EXPECT_TRUE(plain.frames[0].object.empty());
  scenario_.truth.objects = scenario_.truth.optical_flow = scenario_.truth.event_points = true;
  const Collector all = run();
  EXPECT_EQ(all.events, plain.events);
  EXPECT_GT(all.events.size(), 100U);
  EXPECT_EQ(all.frames.size(), 21U);
  EXPECT_EQ(all.intervals.size(), 20U);
  EXPECT_EQ(all.points.size(), all.events.size());
  EXPECT_EQ(all.info.objects, std::vector<std::string>{"card"});

  const Collector again = run(1);
  EXPECT_TRUE(std::ranges::equal(all.points, again.points));
  EXPECT_TRUE(std::ranges::equal(all.intervals[7].x.pixels(), again.intervals[7].x.pixels()));
}

TEST_F(GroundTruth, KnowsTheCardWhereverItIs) {
  scenario_.truth.objects = scenario_.truth.optical_flow = true;
  const Collector out = run();
  const double fx = 32 / std::tan(20 * std::numbers::pi / 180);
  for (std::size_t k = 0; k < out.frames.size(); ++k) {
    const Collector::Frame& frame = out.frames[k];
    int on_card = 0;
    for (int y = 0; y < 48; ++y) {
      for (int x = 0; x < 64; ++x) {
        const bool card = frame.depth(x, y) < 2.5F;
        ASSERT_EQ(frame.object(x, y), card ? 1 : 0);
        on_card += card;
        if (k + 1 == out.frames.size()) continue;
        // The card moves along world y, to the left of the image, by 2 m/s at 2 m for 10 ms; the wall does not.
        ASSERT_NEAR(out.intervals[k].x(x, y), card ? -fx * 0.01 : 0.0, 0.01) << x << ", " << y << ", frame " << k;
        ASSERT_NEAR(out.intervals[k].x(x, y), frame.motion_x(x, y) * 0.01, 0.01);
      }
    }
    EXPECT_GT(on_card, 100);
    ASSERT_EQ(frame.T_world_objects.size(), 1U);
    EXPECT_NEAR(frame.T_world_objects[0].translation.y(), 2 * (to_seconds(frame.t) - 0.5), 1e-6);
  }
}

TEST_F(GroundTruth, FindsTheEdgeThatFiredTheEvents) {
  scenario_.truth.event_points = true;
  const Collector out = run();
  int on_card = 0;
  for (std::size_t i = 0; i < out.events.size(); ++i) {
    // An edge of the card at y = 4 (t - 0.5 s) +- 0.2 m passes through each pixel that fires: within half a pixel, and
    // the 0.3 px that it moves between two samples.
    const double card_y = 2 * (to_seconds(out.events[i].t) - 0.5);
    const Eigen::Vector3f& p = out.points[i];
    const double plane_x = p.x() < -0.5F ? -1.0 : 0.0;
    EXPECT_NEAR(p.x(), plane_x, 1e-5);
    on_card += plane_x == -1.0;
    const double y_at_card = p.y() * 2 / (p.x() + 3);
    EXPECT_LT(std::fabs(std::fabs(y_at_card - card_y) - 0.2), 2.0 / 88 * 1.1) << i;
  }
  EXPECT_GT(on_card, 0);
  EXPECT_LT(on_card, static_cast<int>(out.events.size())) << "some see what is behind the edge";
}

TEST_F(GroundTruth, OfAStereoPairObeysTheEpipolarConstraint) {
  CameraOptions second = scenario_.cameras[0];
  second.name = "cam1";
  second.width = 70;
  second.fx = 80;
  second.distortion = RadialTangentialOptions{{-0.2, 0.05, 0.001, -0.0006, 0}};
  second.T_body_camera.position = {0.12, -0.01, 0.03};
  second.T_body_camera.quaternion = Eigen::Vector4d(0.02, -0.05, 0.01, 1);
  scenario_.cameras[0].distortion = EquidistantOptions{{-0.1385, -0.0415, 0.0081, 0.0042}};
  scenario_.cameras.push_back(second);
  RandomTrajectoryOptions motion;
  motion.position_amplitude_m = {0.2, 0.2, 0.2};
  motion.rotation_amplitude_deg = {10, 10, 10};
  motion.center.position = {-3, 0, 0};
  scenario_.trajectory = motion;
  const Collector out = run();

  const Camera &left = out.info.cameras[0].model, &right = out.info.cameras[1].model;
  int compared = 0, same_depth = 0;
  double worst = 0;
  for (std::size_t k = 0; k + 1 < out.frames.size(); k += 2) {
    const Collector::Frame &a = out.frames[k], &b = out.frames[k + 1];
    ASSERT_TRUE(a.camera == 0 && b.camera == 1 && a.t == b.t);
    const SE3 T_right_left = b.T_world_camera.inverse() * a.T_world_camera;
    const Eigen::Vector3d& t = T_right_left.translation;
    Eigen::Matrix3d cross;
    cross << 0, -t.z(), t.y(), t.z(), 0, -t.x(), -t.y(), t.x(), 0;
    const Eigen::Matrix3d E = cross * T_right_left.rotation.toRotationMatrix();
    for (int y = 0; y < left.height; ++y) {
      for (int x = 0; x < left.width; ++x) {
        const Eigen::Vector3d bearing = left.back_project(Eigen::Vector2d(x, y))->bearing;
        const Eigen::Vector3d point = T_right_left * (double{a.depth(x, y)} * bearing);
        const auto image = right.project(point);
        if (!image) continue;
        const auto back = right.back_project(image->pixel);
        ASSERT_TRUE(back);
        const Eigen::Vector3d line = E * bearing;
        worst = std::max(worst, right.fx * std::fabs(back->bearing.dot(line)) / line.head<2>().norm());
        const int u = static_cast<int>(std::lround(image->pixel.x())),
                  v = static_cast<int>(std::lround(image->pixel.y()));
        if (u < 0 || v < 0 || u >= right.width || v >= right.height) continue;
        ++compared;
        same_depth += std::fabs(b.depth(u, v) - point.z()) < 0.02 * point.z();
      }
    }
  }
  EXPECT_LT(worst, 1e-6);
  EXPECT_GT(compared, 30000);
  EXPECT_GT(same_depth, 0.95 * compared) << "both cameras see the same scene, but for what the card hides";
}

TEST_F(GroundTruth, SaysWhyItCannotBeHad) {
  scenario_.truth.optical_flow = true;
  scenario_.truth.rate_hz = 0;
  EXPECT_TRUE(
      test::contains(error(), "truth.optical_flow: needs two frames of ground truth, but truth.rate_hz = 0 gives 0"));
  scenario_.truth.rate_hz = 4;
  EXPECT_TRUE(test::contains(error(), "rate_hz = 4 gives 1 in 0.2 s; raise truth.rate_hz"));
  scenario_.truth.rate_hz = 5;
  EXPECT_EQ(error(), "nothing was thrown");
  EXPECT_EQ(warnings_, "");
  scenario_.truth.rate_hz = 1e9;
  EXPECT_EQ(error(), "nothing was thrown");
  EXPECT_TRUE(test::contains(warnings_, "truth.rate_hz = 1000000000 makes 200000001 frames"));

  scenario_.truth = {};
  scenario_.truth.event_points = true;
  folder_.write("sky.pgm", "P2 4 2 255\n1 2 3 4\n5 6 7 8\n");
  PanoramaRendererOptions panorama;
  panorama.image = folder_.path() / "sky.pgm";
  scenario_.renderer = panorama;
  EXPECT_TRUE(test::contains(error(), "truth.event_points: needs finite depth, but everything in panorama"));

  scenario_.truth = {};
  scenario_.truth.optical_flow = true;
  EXPECT_EQ(error(), "nothing was thrown") << "directions move in the image, too";
  SpritesRendererOptions sprites;
  sprites.sprites.resize(1);
  sprites.sprites[0].image = folder_.path() / "sky.pgm";
  scenario_.renderer = sprites;
  EXPECT_TRUE(test::contains(error(), "truth.optical_flow: needs depth, but sprites are drawn on the sensor"));
}

}  // namespace
}  // namespace esim
