// Frame cameras within simulations: what they see, and when it is delivered.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgcodecs.hpp>

#include "esim/compose/compose.h"
#include "esim/core/error.h"
#include "esim/sim/simulate.h"
#include "support/errors.h"
#include "support/temporary_directory.h"

namespace esim {
namespace {

const Notices kSilent{[](const std::string&) {}, [](const std::string&) {}};

/// Keeps frames, and checks their place among the other records.
class FrameCollector final : public Sink {
 public:
  struct Frame {
    int camera;
    TimeNs t, start, duration;
    Image<std::uint16_t> image;
  };

  void begin(const RecordingInfo&) override {}
  void write(const Record& record) override {
    if (const auto* part = std::get_if<EventsRecord>(&record)) now_ = std::max(now_, part->events.back().t);
    if (const auto* pose = std::get_if<PoseRecord>(&record)) now_ = pose->t;
    if (const auto* frame = std::get_if<FrameRecord>(&record)) {
      const TimeNs end = frame->exposure_start + frame->exposure_duration + readout;
      EXPECT_GE(end, now_) << "after what happened when it was there";
      EXPECT_LE(end, now_ + 5 * kNsPerMs) << "long before it was there";
      frames.push_back({frame->camera, frame->t, frame->exposure_start, frame->exposure_duration, frame->image});
    }
  }
  void end(bool) override {}

  std::vector<Frame> frames;
  TimeNs readout = 0;  // from the first row to the last

 private:
  TimeNs now_ = 0;
};

/// A panorama with sharp edges, seen by a camera that turns fast.
class SimulatedFrames : public testing::Test {
 protected:
  void SetUp() override {
    cv::Mat image(128, 256, CV_8U);
    for (int y = 0; y < image.rows; ++y) {
      for (int x = 0; x < image.cols; ++x)
        image.at<unsigned char>(y, x) = static_cast<unsigned char>((x / 5 + y / 6) % 2 == 0 ? 230 : 20 + x / 3);
    }
    cv::imwrite((folder_.path() / "p.png").string(), image);

    RandomTrajectoryOptions motion;
    motion.rotation_amplitude_deg = {20, 40, 30};
    motion.knot_interval_s = 0.06;
    scenario_.trajectory = motion;
    scenario_.renderer = PanoramaRendererOptions{folder_.path() / "p.png", {0, 0, 0, 1}, 0, 1.0};
    scenario_.duration_s = 0.12;
    scenario_.seed = 5;
    scenario_.truth.rate_hz = 0;
    CameraOptions camera;
    camera.name = "cam0";
    camera.width = 48, camera.height = 36;
    camera.frame_camera.emplace();
    camera.frame_camera->rate_hz = 25;
    camera.frame_camera->exposure_s = 0.02;
    scenario_.cameras = {camera};
  }

  FrameCollector run(int threads = 1) {
    World world = build_world(scenario_, threads, kSilent);
    FrameCollector out;
    out.readout = to_ns(scenario_.cameras[0].frame_camera->line_delay_s * 35);
    summary_ = simulate(world, out, [](const Progress&) { return true; });
    return out;
  }

  /// The mean of renderings at 20 kHz over an exposure.
  Image<double> dense_mean(TimeNs start, TimeNs duration) {
    World world = build_world(scenario_, 1, kSilent);
    Sample sample;
    constexpr int kRenderings = 400;
    Image<double> mean(48, 36);
    for (int i = 0; i < kRenderings; ++i) {
      world.cameras[0].renderer->render(view(world, 0, start + (2 * i + 1) * duration / (2 * kRenderings)), sample);
      for (std::size_t k = 0; k < mean.size(); ++k)
        mean.pixels()[k] += static_cast<double>(sample.irradiance.pixels()[k]) / kRenderings;
    }
    return mean;
  }

  static double root_mean_square(const Image<double>& a, const Image<double>& b) {
    double squares = 0;
    for (std::size_t k = 0; k < a.size(); ++k) squares += std::pow(a.pixels()[k] - b.pixels()[k], 2);
    return std::sqrt(squares / static_cast<double>(a.size()));
  }

  test::TemporaryDirectory folder_;
  Scenario scenario_;
  Summary summary_;
};

TEST_F(SimulatedFrames, EqualTheMeanOfADenseRendering) {
  struct Case {
    SamplingOptions sampling;
    double largest, root_mean_square;  // of the difference, in digital numbers; quantisation alone is 0.5 and 0.29
  };
  for (const Case& scheme : {Case{UniformSampling{4000}, 0.52, 0.3}, Case{FlowSampling{}, 1, 0.35},
                             Case{AdaptiveSampling{.tolerance = 0.1}, 2, 0.4}, Case{KeyframeSampling{}, 4, 0.6}}) {
    scenario_.cameras[0].sampling = scheme.sampling;
    const FrameCollector out = run();
    ASSERT_EQ(out.frames.size(), 2U);
    EXPECT_EQ(summary_.cameras[0].frames, 2);
    for (const auto& frame : out.frames) {
      const Image<double> expected = dense_mean(frame.start, frame.duration);
      EXPECT_GT(root_mean_square(dense_mean(frame.t, 1), expected), 5.0 / 255) << "hardly a blur to look at";
      Image<double> seen(48, 36);
      double largest = 0;
      for (std::size_t k = 0; k < expected.size(); ++k) {
        seen.pixels()[k] = frame.image.pixels()[k] / 255.0;
        largest = std::max(largest, std::fabs(seen.pixels()[k] - expected.pixels()[k]));
      }
      EXPECT_LE(255 * largest, scheme.largest) << scheme.sampling.index();
      EXPECT_LE(255 * root_mean_square(seen, expected), scheme.root_mean_square) << scheme.sampling.index();
    }
  }
}

TEST_F(SimulatedFrames, AreTheSameWithAnyNumberOfThreads) {
  for (const SamplingOptions& sampling : {SamplingOptions{AdaptiveSampling{}}, SamplingOptions{KeyframeSampling{}}}) {
    scenario_.cameras[0].sampling = sampling;
    scenario_.cameras[0].frame_camera->shot_noise = true;
    scenario_.cameras[0].frame_camera->line_delay_s = 1e-4;
    const FrameCollector one = run(1), three = run(3);
    ASSERT_EQ(one.frames.size(), three.frames.size());
    for (std::size_t k = 0; k < one.frames.size(); ++k)
      EXPECT_TRUE(std::ranges::equal(one.frames[k].image.pixels(), three.frames[k].image.pixels()));
  }
}

TEST_F(SimulatedFrames, AdaptWithEverySampler) {
  // Exposures follow from digital numbers, and those hardly depend on the sampling.
  scenario_.duration_s = 0.2;
  scenario_.cameras[0].frame_camera->rate_hz = 100;
  scenario_.cameras[0].frame_camera->exposure_s = 0.001;
  scenario_.cameras[0].frame_camera->auto_exposure = AutoExposureOptions{.target = 0.6};
  const FrameCollector flow = run();
  ASSERT_EQ(flow.frames.size(), 19U);
  EXPECT_GT(flow.frames[2].duration, flow.frames[1].duration);
  for (const SamplingOptions& sampling : {SamplingOptions{AdaptiveSampling{}}, SamplingOptions{KeyframeSampling{}}}) {
    scenario_.cameras[0].sampling = sampling;
    const FrameCollector other = run();
    ASSERT_EQ(other.frames.size(), flow.frames.size());
    for (std::size_t k = 0; k < flow.frames.size(); ++k) {
      const double ratio = static_cast<double>(other.frames[k].duration) / static_cast<double>(flow.frames[k].duration);
      EXPECT_NEAR(ratio, 1, 0.01) << k;
    }
  }
}

TEST_F(SimulatedFrames, ChangeNoEventAndNoOtherCamera) {
  struct Events final : Sink {
    void begin(const RecordingInfo&) override {}
    void write(const Record& record) override {
      if (const auto* part = std::get_if<EventsRecord>(&record)) {
        auto& list = part->camera == 0 ? first : second;
        list.insert(list.end(), part->events.begin(), part->events.end());
      }
    }
    void end(bool) override {}
    std::vector<Event> first, second;
  };
  const auto events = [&] {
    World world = build_world(scenario_, 1, kSilent);
    Events out;
    simulate(world, out, [](const Progress&) { return true; });
    return out;
  };
  const FrameCollector alone = run();
  scenario_.cameras.push_back(scenario_.cameras[0]);
  scenario_.cameras[1].name = "cam1";
  scenario_.cameras[1].width = 32;
  scenario_.cameras[1].frame_camera->rate_hz = 50;
  const FrameCollector rig = run();
  std::vector<Image<std::uint16_t>> first;
  for (const auto& frame : rig.frames) {
    if (frame.camera == 0) first.push_back(frame.image);
  }
  ASSERT_EQ(first.size(), alone.frames.size());
  EXPECT_EQ(rig.frames.size(), 2U + 5U);
  for (std::size_t k = 0; k < first.size(); ++k)
    EXPECT_TRUE(std::ranges::equal(first[k].pixels(), alone.frames[k].image.pixels()));
  const Events with = events();
  for (CameraOptions& camera : scenario_.cameras) camera.frame_camera.reset();
  const Events without = events();
  EXPECT_GT(with.first.size(), 1000U);
  EXPECT_EQ(with.first, without.first);
  EXPECT_EQ(with.second, without.second);
}

TEST_F(SimulatedFrames, AreRefusedByCameraAndOption) {
  scenario_.cameras[0].frame_camera->exposure_s = 0.1;
  const std::string message = test::message_of<UserError>([&] { build_world(scenario_, 1, kSilent); });
  EXPECT_TRUE(test::contains(message, "camera cam0: frame_camera.exposure_s: 0.1 s"));
}

}  // namespace
}  // namespace esim
