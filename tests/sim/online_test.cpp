#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "esim/compose/compose.h"
#include "esim/core/error.h"
#include "esim/geometry/so3.h"
#include "esim/motion/online.h"
#include "esim/scenario/sampling_text.h"
#include "support/errors.h"
#include "support/temporary_directory.h"

namespace esim {
namespace {

/// Keeps what a run writes.
class Logbook final : public Sink {
 public:
  void begin(const RecordingInfo&) override {}
  void write(const Record& record) override {
    if (const auto* part = std::get_if<EventsRecord>(&record))
      events.insert(events.end(), part->events.begin(), part->events.end());
    if (const auto* measurement = std::get_if<ImuRecord>(&record)) imu.push_back(*measurement);
    if (const auto* pose = std::get_if<PoseRecord>(&record)) poses.push_back(*pose);
    if (const auto* truth = std::get_if<TruthRecord>(&record)) truth_times.push_back(truth->t);
  }
  void end(bool is_complete) override { complete = is_complete; }

  std::vector<Event> events;
  std::vector<ImuRecord> imu;
  std::vector<PoseRecord> poses;
  std::vector<TimeNs> truth_times;
  bool complete = false;
};

constexpr TimeNs kInterval = 10 * kNsPerMs;
constexpr int kSteps = 40;
const Notices kQuiet{[](const std::string&) {}, [](const std::string&) {}};
const Monitor kOn = [](const Progress&) { return true; };

/// A camera that looks down at a plane, which it crosses while turning.
SE3 pose(int step) {
  const double s = 0.01 * std::max(step, 0);
  const Eigen::Quaterniond down(0, 1, 0, 0);
  return {(so3_exp(Eigen::Vector3d(0, 0, s * s)) * down).normalized(), Eigen::Vector3d(3 * s * s, -s * s, 1)};
}

class OnlineSimulation : public testing::TestWithParam<const char*> {
 protected:
  void SetUp() override {
    std::ofstream image(folder_.path() / "p.pgm");
    image << "P2 64 64 255\n";
    for (int i = 0; i < 64 * 64; ++i)
      image << 128 + static_cast<int>(100 * std::sin(i * 0.4) * std::sin(i / 64 * 0.3)) << "\n";
    PlaneRendererOptions floor;
    floor.image = folder_.path() / "p.pgm";
    floor.width_m = 2;
    floor.endless = true;
    floor.pose.quaternion = {1, 0, 0, 0};
    scenario_.renderer = floor;
    scenario_.duration_s = 0.01 * kSteps;
    scenario_.imu.emplace();
    scenario_.truth.rate_hz = 60;
    CameraOptions camera;
    camera.name = "cam0";
    camera.width = 48, camera.height = 32;
    camera.event_camera.contrast_threshold = 0.1;
    camera.sampling = read_sampling(GetParam());
    scenario_.cameras = {camera};
  }

  test::TemporaryDirectory folder_;
  Scenario scenario_;
};

TEST_P(OnlineSimulation, IsTheSameAsWithTheWholeMotionKnownBeforehand) {
  auto known = std::make_shared<OnlineTrajectory>(OnlineMotionOptions{.interval = kInterval}, pose(0));
  for (int k = 1; k <= kSteps; ++k) known->push(pose(k));
  World world = build_world(scenario_, known, 1, kQuiet);
  Logbook whole;
  EXPECT_TRUE(simulate(world, whole, kOn).complete);

  auto growing = std::make_shared<OnlineTrajectory>(OnlineMotionOptions{.interval = kInterval}, pose(0));
  World online = build_world(scenario_, growing, 1, kQuiet);
  Logbook steps;
  Simulator simulator(online, steps);
  for (int k = 1; k <= kSteps; ++k) {
    growing->push(pose(k));
    EXPECT_TRUE(simulator.advance_until(growing->final_until(), kOn));
    ASSERT_EQ(steps.imu.back().t, growing->final_until()) << "the IMU waits for nothing";
    if (k == kSteps / 2 && std::string(GetParam()) != "keyframes") {
      EXPECT_GT(steps.events.size(), 100U) << "events come on the way";
    }
  }
  const Summary summary = simulator.finish();
  EXPECT_TRUE(summary.complete && steps.complete);
  EXPECT_EQ(summary.end, online.info.end);

  EXPECT_GT(whole.events.size(), 2000U);
  EXPECT_EQ(whole.events, steps.events);
  EXPECT_EQ(whole.truth_times, steps.truth_times);
  ASSERT_EQ(whole.imu.size(), steps.imu.size());
  for (std::size_t i = 0; i < whole.imu.size(); ++i) {
    EXPECT_EQ(whole.imu[i].t, steps.imu[i].t);
    EXPECT_EQ(whole.imu[i].measured.specific_force, steps.imu[i].measured.specific_force);
  }
  ASSERT_EQ(whole.poses.size(), steps.poses.size());
  for (std::size_t i = 0; i < whole.poses.size(); ++i) {
    EXPECT_EQ(whole.poses[i].body.velocity_world, steps.poses[i].body.velocity_world);
    EXPECT_EQ(whole.poses[i].imu_bias->specific_force, steps.poses[i].imu_bias->specific_force);
  }
}

INSTANTIATE_TEST_SUITE_P(Samplings, OnlineSimulation,
                         testing::Values("flow", "uniform rate_hz=333", "brightness", "adaptive", "keyframes"));

TEST_P(OnlineSimulation, EndsEarlyAsInterrupted) {
  auto motion = std::make_shared<OnlineTrajectory>(OnlineMotionOptions{.interval = kInterval}, pose(0));
  World world = build_world(scenario_, motion, 1, kQuiet);
  Logbook out;
  Simulator simulator(world, out);
  for (int k = 1; k <= 5; ++k) motion->push(pose(k));
  EXPECT_TRUE(simulator.advance_until(world.info.end, kOn)) << "no further than the motion is known";
  EXPECT_EQ(out.imu.back().t, motion->final_until());
  const Summary summary = simulator.finish();
  EXPECT_FALSE(summary.complete || out.complete);
  EXPECT_LE(summary.end, motion->final_until());
}

TEST_P(OnlineSimulation, WaitsForAStartThatComesLater) {
  scenario_.start_s = 0.1;
  scenario_.duration_s = 0.1;
  auto motion = std::make_shared<OnlineTrajectory>(OnlineMotionOptions{.interval = kInterval}, pose(0));
  World world = build_world(scenario_, motion, 1, kQuiet);
  Logbook out;
  Simulator simulator(world, out);
  for (int k = 1; k <= 20; ++k) {
    motion->push(pose(k));
    EXPECT_TRUE(simulator.advance_until(motion->final_until(), kOn));
    EXPECT_EQ(out.imu.empty(), k < 10);
  }
  EXPECT_TRUE(simulator.finish().complete);
  EXPECT_EQ(out.imu.front().t, 100 * kNsPerMs);
  EXPECT_EQ(out.imu.back().t, 200 * kNsPerMs);
}

TEST_P(OnlineSimulation, NeedsADuration) {
  scenario_.duration_s.reset();
  const auto motion = std::make_shared<OnlineTrajectory>(OnlineMotionOptions{}, pose(0));
  EXPECT_TRUE(test::contains(test::message_of<UserError>([&] { build_world(scenario_, motion, 1, kQuiet); }),
                             "duration_s: is missing"));
}

}  // namespace
}  // namespace esim
