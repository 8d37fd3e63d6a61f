#include "esim/sim/simulate.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgcodecs.hpp>

#include "esim/compose/compose.h"
#include "esim/core/error.h"
#include "sim/blobs.h"
#include "support/errors.h"
#include "support/named_result.h"
#include "support/temporary_directory.h"

namespace esim {
namespace {

/// Keeps everything, and checks the order in which it arrives.
class Collector final : public Sink {
 public:
  void begin(const RecordingInfo& recording) override {
    info = recording;
    events.resize(recording.cameras.size());
  }
  void write(const Record& record) override {
    if (const auto* part = std::get_if<EventsRecord>(&record)) {
      auto& stream = events[static_cast<std::size_t>(part->camera)];
      for (const Event& event : part->events) {
        EXPECT_GE(event.t, last_truth) << "an event after the ground truth that it precedes";
        stream.push_back(event);
      }
    }
    if (const auto* truth = std::get_if<TruthRecord>(&record)) {
      last_truth = truth->t;
      truth_times.push_back(truth->t);
      for (const auto& stream : events) {
        EXPECT_TRUE(stream.empty() || stream.back().t <= truth->t);
      }
    }
    if (const auto* pose = std::get_if<PoseRecord>(&record)) pose_times.push_back(pose->t);
  }
  void end(bool is_complete) override { complete = is_complete; }

  RecordingInfo info;
  std::vector<std::vector<Event>> events;
  std::vector<TimeNs> truth_times, pose_times;
  TimeNs last_truth = 0;
  bool complete = false;
};

/// A panorama of soft blobs, seen by a camera that turns at random.
class Simulation : public testing::Test {
 protected:
  void SetUp() override {
    test::write_blobs(folder_.path() / "p.png", 256);

    RandomTrajectoryOptions motion;
    motion.rotation_amplitude_deg = {20, 40, 30};
    scenario_.trajectory = motion;
    scenario_.renderer = PanoramaRendererOptions{folder_.path() / "p.png", {0, 0, 0, 1}};
    scenario_.duration_s = 0.25;
    scenario_.seed = 5;
    CameraOptions camera;
    camera.name = "cam0";
    camera.width = 64, camera.height = 48;
    camera.event_camera.contrast_threshold = 0.1;
    camera.event_camera.threshold_mismatch = 0.01;
    camera.event_camera.threshold_noise = 0.01;
    scenario_.cameras = {camera};
  }

  Summary run(
      Collector& out, int threads = 1, const Monitor& monitor = [](const Progress&) { return true; }) {
    World world = build_world(scenario_, threads, {[](const std::string&) {}, [](const std::string&) {}});
    return simulate(world, out, monitor);
  }

  test::TemporaryDirectory folder_;
  Scenario scenario_;
};

TEST_F(Simulation, DeliversOrderedEventsAndGroundTruthAtItsOwnRate) {
  Collector out;
  const Summary summary = run(out);
  EXPECT_TRUE(summary.complete && out.complete);
  EXPECT_EQ(summary.end, 250 * kNsPerMs);
  ASSERT_GT(out.events[0].size(), 10000U);
  EXPECT_TRUE(std::is_sorted(out.events[0].begin(), out.events[0].end()));
  EXPECT_GT(out.events[0].front().t, 0);
  EXPECT_LE(out.events[0].back().t, 250 * kNsPerMs);
  EXPECT_EQ(static_cast<std::size_t>(summary.cameras[0].events()), out.events[0].size());
  ASSERT_EQ(out.truth_times.size(), 8U);
  EXPECT_EQ(out.truth_times[0], 0);
  EXPECT_EQ(out.truth_times[1], 33'333'333);
  EXPECT_EQ(out.pose_times.size(), 51U);
}

TEST_F(Simulation, IsTheSameWithAnyNumberOfThreadsAndAnyRateOfGroundTruth) {
  Collector one, two, other_rate;
  run(one, 1);
  run(two, 2);
  scenario_.truth.rate_hz = 111;
  run(other_rate, 2);
  EXPECT_EQ(one.events, two.events);
  EXPECT_EQ(one.events, other_rate.events);
}

TEST_F(Simulation, DependsOnTheSeed) {
  Collector a, b;
  run(a);
  scenario_.seed = 6;
  run(b);
  EXPECT_NE(a.events, b.events);
}

TEST_F(Simulation, RunsSeveralCamerasEachWithItsOwnClock) {
  Collector alone, rig;
  run(alone);
  CameraOptions second = scenario_.cameras[0];
  second.name = "cam1";
  second.width = 32;
  second.sampling = UniformSampling{444};
  scenario_.cameras.push_back(second);
  const Summary summary = run(rig);
  EXPECT_EQ(rig.events[0], alone.events[0]) << "a second camera changed the first one's events";
  EXPECT_EQ(summary.cameras[1].sampling.samples, 112);
  EXPECT_GT(rig.events[1].size(), 1000U);
  EXPECT_EQ(rig.truth_times.size(), 16U);
}

TEST_F(Simulation, SeesTheSameThroughKeyframes) {
  scenario_.cameras[0].event_camera.threshold_noise = 0;
  Collector flow, keyframes, two_threads;
  const std::int64_t dense = run(flow).cameras[0].sampling.samples;
  scenario_.cameras[0].sampling = KeyframeSampling{};
  const Summary summary = run(keyframes);
  run(two_threads, 2);
  const SamplingStatistics& sampling = summary.cameras[0].sampling;
  EXPECT_LT(sampling.samples - sampling.audits, dense / 10);
  EXPECT_EQ(sampling.audits, 1);
  EXPECT_TRUE(test::named_result<MeasuredError>(sampling, "resampling_error").has_value());
  EXPECT_GT(flow.events[0].size(), 10000U);
  const double ratio = static_cast<double>(keyframes.events[0].size()) / static_cast<double>(flow.events[0].size());
  EXPECT_NEAR(ratio, 1, 0.03);
  EXPECT_EQ(keyframes.events, two_threads.events);
  EXPECT_EQ(keyframes.truth_times, flow.truth_times);
}

TEST_F(Simulation, EndsEarlyWhenAsked) {
  Collector out;
  const Summary summary = run(out, 1, [](const Progress& progress) { return progress.now < 100 * kNsPerMs; });
  EXPECT_FALSE(summary.complete);
  EXPECT_FALSE(out.complete);
  EXPECT_GE(summary.end, 100 * kNsPerMs);
  EXPECT_LT(summary.end, 200 * kNsPerMs);
  EXPECT_LE(out.events[0].back().t, summary.end);
}

TEST_F(Simulation, SeesNoDotsThatAMedianTakesFromThePanorama) {
  cv::Mat dots(128, 256, CV_8U, cv::Scalar(127));
  for (int y = 4; y < dots.rows; y += 8) {
    for (int x = 0; x < dots.cols; x += 8) dots.at<unsigned char>(y, x) = (x / 8 + y / 8) % 2 == 0 ? 255 : 0;
  }
  PanoramaRendererOptions renderer;
  renderer.image = folder_.path() / "dots.png";
  cv::imwrite(renderer.image.string(), dots);
  scenario_.renderer = renderer;
  Collector raw, clean, blurred;
  run(raw);
  renderer.median_px = 3;
  scenario_.renderer = renderer;
  run(clean);
  renderer.median_px = 0;
  renderer.gaussian_px = 50;
  scenario_.renderer = renderer;
  run(blurred);
  EXPECT_GT(raw.events[0].size(), 1000U);
  EXPECT_EQ(clean.events[0].size(), 0U);
  EXPECT_EQ(blurred.events[0].size(), 0U);
}

TEST_F(Simulation, RefusesWhatCannotBeSimulated) {
  const auto error = [&] {
    return test::message_of<UserError>([&] {
      build_world(scenario_, 1, {[](const std::string&) {}, [](const std::string&) {}});
    });
  };
  scenario_.duration_s.reset();
  EXPECT_TRUE(test::contains(error(), "duration_s"));
  scenario_.duration_s = 1;
  AdaptiveSampling adaptive;
  adaptive.bounds = {100, 50};
  for (const SamplingOptions& sampling : {SamplingOptions(FlowSampling{0.5, {100, 50}}), SamplingOptions(adaptive)}) {
    scenario_.cameras[0].sampling = sampling;
    EXPECT_TRUE(test::contains(error(), "min_rate_hz")) << sampling.index();
  }
  scenario_.cameras[0].sampling = FlowSampling{};
  std::get<PanoramaRendererOptions>(scenario_.renderer).median_px = 2;
  EXPECT_TRUE(test::contains(error(), "must be an odd number"));
  PlaneRendererOptions behind;
  behind.image = folder_.path() / "p.png";
  behind.pose.position = {-5, 0, 0};
  behind.pose.look_at = Eigen::Vector3d(0, 0, 0);
  scenario_.renderer = behind;
  EXPECT_TRUE(test::contains(error(), "never sees"));
  behind.median_px = 2;
  scenario_.renderer = behind;
  EXPECT_TRUE(test::contains(error(), "must be an odd number"));
  behind.image = folder_.path() / "q.png";
  scenario_.renderer = behind;
  EXPECT_TRUE(test::contains(error(), "no such file"));
}

TEST_F(Simulation, WarnsWhenTheBoundOfTheCriterionIsGivenUp) {
  scenario_.cameras[0].sampling = FlowSampling{1.5, {}};
  std::string warning;
  build_world(scenario_, 1, {[&](const std::string& text) { warning = text; }, [](const std::string&) {}});
  EXPECT_TRUE(test::contains(warning, "lambda = 1.5 is above 1"));
}

}  // namespace
}  // namespace esim
