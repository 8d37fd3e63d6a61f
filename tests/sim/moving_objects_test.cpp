// Moving objects from the scenario to the events.
#include <gtest/gtest.h>

#include "sim/card_scene.h"

namespace esim {
namespace {

/// Counts events and keeps the motion field of the last ground truth.
class Counter final : public Sink {
 public:
  void begin(const RecordingInfo& recording) override { info = recording; }
  void write(const Record& record) override {
    if (const auto* part = std::get_if<EventsRecord>(&record))
      events.insert(events.end(), part->events.begin(), part->events.end());
    if (const auto* truth = std::get_if<TruthRecord>(&record)) motion_x = truth->motion_x;
    if (const auto* pose = std::get_if<PoseRecord>(&record)) poses.push_back(*pose);
  }
  void end(bool) override {}

  RecordingInfo info;
  std::vector<Event> events;
  std::vector<PoseRecord> poses;
  Image<float> motion_x;
};

class MovingObjects : public test::CardScene {
 protected:
  MovingObjects() { scenario_.duration_s = 1.0; }

  Summary run(Counter& out, int threads = 1) { return simulate_into(out, threads); }
};

TEST_F(MovingObjects, FireEventsBeforeACameraAtRestAndDriveItsSampling) {
  Counter out;
  const Summary summary = run(out);
  EXPECT_GT(out.events.size(), 500U);

  // 2 m/s at 2 m are 1 rad/s times fx = 32 / tan 20 deg = 88 px/s: a sample per half a pixel while the card is in
  // sight.
  EXPECT_GT(summary.cameras[0].sampling.samples, 100);
  mesh().objects.clear();
  Counter nothing;
  EXPECT_LT(run(nothing).cameras[0].sampling.samples, summary.cameras[0].sampling.samples / 2);
  EXPECT_EQ(nothing.events.size(), 0U);
}

TEST_F(MovingObjects, AreInTheRecordWithTheirMotion) {
  Counter out;
  run(out);
  EXPECT_EQ(out.info.objects, std::vector<std::string>{"card"});
  ASSERT_EQ(out.poses.size(), 201U);
  for (const PoseRecord& pose : out.poses) {
    ASSERT_EQ(pose.objects.size(), 1U);
    const double y = -1 + 2 * to_seconds(pose.t);
    EXPECT_LT((pose.objects[0].T_world_body.translation - Eigen::Vector3d(-1, y, 0)).norm(), 1e-6);
    EXPECT_LT((pose.objects[0].velocity_world - Eigen::Vector3d(0, 2, 0)).norm(), 1e-4);
  }
}

TEST_F(MovingObjects, AreTheSameWithAnyNumberOfThreads) {
  RandomTrajectoryOptions random;
  random.position_amplitude_m = {0.3, 0.5, 0.4};
  random.rotation_amplitude_deg = {40, 40, 40};
  random.center.position = {-1, 0, 0};
  mesh().objects[0].trajectory = random;
  mesh().objects.push_back(mesh().objects[0]);
  mesh().objects[1].name = "other card";
  mesh().lighting = LambertOptions{0.2, {{{1, 0.2, -0.5}, 1.0}}, {}, true};
  scenario_.duration_s = 0.3;
  Counter one, two, other_seed;
  run(one, 1);
  run(two, 2);
  EXPECT_EQ(one.events, two.events);
  EXPECT_GT(one.events.size(), 100U);
  scenario_.seed = 1;
  run(other_seed);
  EXPECT_NE(one.events, other_seed.events);
}

TEST_F(MovingObjects, OfOneSeedMoveEachInTheirOwnWay) {
  RandomTrajectoryOptions random;
  random.position_amplitude_m = {1, 1, 1};
  mesh().objects[0].trajectory = random;
  mesh().objects.push_back(mesh().objects[0]);
  mesh().objects[1].name = "other card";
  const World world = build_world(scenario_, 1, {[](const std::string&) {}, [](const std::string&) {}});
  const auto request = view(world, 0, 500 * kNsPerMs);
  ASSERT_EQ(request.objects.size(), 2U);
  EXPECT_GT((request.objects[0].T_world_body.translation - request.objects[1].T_world_body.translation).norm(), 1e-3);
  EXPECT_TRUE(request.objects[0].T_world_body.rotation.isApprox(Eigen::Quaterniond::Identity()));
}

TEST_F(MovingObjects, AreRefusedWhereTheirMotionIsNot) {
  scenario_.duration_s = 1.5;
  EXPECT_TRUE(test::contains(error(), "renderer.objects.0.trajectory: lasts from 0 to 1 s"));
  std::get<FileTrajectoryOptions>(mesh().objects[0].trajectory).time_scale = 2;
  EXPECT_EQ(error(), "nothing was thrown");
  std::get<FileTrajectoryOptions>(mesh().objects[0].trajectory).path.clear();
  EXPECT_TRUE(test::contains(error(), "renderer.objects.0.trajectory.path: is missing"));
  mesh().objects.push_back(mesh().objects[0]);
  EXPECT_TRUE(
      test::contains(error(), "renderer.objects.1.name: must be unique, but another object is also named card"));
  mesh().objects.clear();
  mesh().objects.resize(1);
  mesh().objects[0].trajectory = StaticTrajectoryOptions{};
  EXPECT_TRUE(test::contains(error(), "renderer.objects.0.scene: is missing"));
  mesh().objects.clear();
  mesh().lighting = LambertOptions{0.2, {{{0, 0, 0}, 1.0}}, {}, false};
  EXPECT_TRUE(test::contains(error(), "renderer.lighting.suns: direction must not be [0, 0, 0]"));
}

}  // namespace
}  // namespace esim
