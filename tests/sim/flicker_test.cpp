// Flickering light from the scenario to events, frames and ground truth.
#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "esim/scenario/read.h"
#include "sim/card_scene.h"

namespace esim {
namespace {

/// Keeps everything.
class Keeper final : public Sink {
 public:
  void begin(const RecordingInfo&) override {}
  void write(const Record& record) override {
    if (const auto* part = std::get_if<EventsRecord>(&record))
      events.insert(events.end(), part->events.begin(), part->events.end());
    if (const auto* truth = std::get_if<TruthRecord>(&record)) images.emplace_back(truth->t, truth->irradiance);
    if (const auto* frame = std::get_if<FrameRecord>(&record)) frames.push_back(frame->image);
  }
  void end(bool complete) override { EXPECT_TRUE(complete); }

  std::vector<Event> of(int x, int y) const {
    std::vector<Event> own;
    std::copy_if(events.begin(), events.end(), std::back_inserter(own),
                 [&](const Event& event) { return event.x == x && event.y == y; });
    return own;
  }

  /// All events, those of one pixel after those of another.
  std::vector<Event> by_pixel() const {
    std::vector<Event> sorted = events;
    std::stable_sort(sorted.begin(), sorted.end(),
                     [](const Event& a, const Event& b) { return std::pair(a.y, a.x) < std::pair(b.y, b.x); });
    return sorted;
  }

  std::vector<Event> events;
  std::vector<std::pair<TimeNs, Image<float>>> images;
  std::vector<Image<std::uint16_t>> frames;
};

/// The events of an ideal pixel whose brightness is L(t), by bisection.
template <typename Brightness>
std::vector<Event> crossings(const Brightness& L, TimeNs end, double threshold) {
  std::vector<Event> events;
  double reference = L(0);
  for (TimeNs t = 0; t < end; t += 1000) {
    while (std::abs(L(t + 1000) - reference) >= threshold) {
      const int sign = L(t + 1000) > reference ? 1 : -1;
      TimeNs before = t, after = t + 1000;
      while (after - before > 1) {
        const TimeNs middle = (before + after) / 2;
        (sign * (L(middle) - reference) >= threshold ? after : before) = middle;
      }
      reference += sign * threshold;
      events.push_back({after, 0, 0, static_cast<std::int8_t>(sign)});
    }
  }
  return events;
}

const FlickerOptions kPwm{1000, 1, FlickerShape::pwm, 0.3, 0.2};

class FlickeringLight : public test::CardScene {
 protected:
  FlickeringLight() {
    scenario_.duration_s = 0.05;
    scenario_.truth.rate_hz = 0;
    camera().sampling = UniformSampling{100};
    camera().event_camera.contrast_threshold = 0.1;
    mesh().objects.clear();
    mesh().samples_per_pixel = 1;  // where triangles meet, the mean over the area of a pixel is rounded
    scenario_.light.flicker = FlickerOptions{100, 0.5, FlickerShape::mains, 0.5, 0.1};
  }

  CameraOptions& camera() { return scenario_.cameras[0]; }

  /// For scenes in which all pixels see the same.
  void take_few_pixels() { camera().width = 8, camera().height = 8; }

  /// A card at rest in the middle of the image.
  void add_card(const std::optional<FlickerOptions>& flicker) {
    StaticTrajectoryOptions still;
    still.pose.position = {-1, 0, 0};
    still.pose.quaternion = Eigen::Vector4d(0, 0, 0, 1);
    mesh().objects = {{"card", folder_.path() / "card.obj", 1.0, still, {}, flicker}};
  }

  /// The card of CardScene, which crosses the image at 0.5 s.
  void add_moving_card() {
    FileTrajectoryOptions path;
    path.path = folder_.path() / "card.txt";
    mesh().objects = {{"card", folder_.path() / "card.obj", 1.0, path}};
    scenario_.start_s = 0.45;
    scenario_.duration_s = 0.1;
  }

  /// Of a scene in which all pixels see the same.
  void expect_same_events_of_all_pixels(const Keeper& out) {
    std::vector<Event> wanted;
    for (const Event& event : out.of(0, 0)) {
      for (int y = 0; y < camera().height; ++y) {
        for (int x = 0; x < camera().width; ++x)
          wanted.push_back({event.t, static_cast<std::uint16_t>(x), static_cast<std::uint16_t>(y), event.polarity});
      }
    }
    std::sort(wanted.begin(), wanted.end());
    std::vector<Event> events = out.events;
    std::sort(events.begin(), events.end());
    EXPECT_TRUE(events == wanted) << events.size() << " instead of " << wanted.size() << " events";
  }

  Keeper run(int threads = 2) {
    Keeper out;
    simulate_into(out, threads);
    return out;
  }
};

TEST_F(FlickeringLight, FiresWhenTheBrightnessCrossesThresholdsAtAnyRateOfSamples) {
  take_few_pixels();
  scenario_.duration_s = 0.049;  // not a multiple of the period, after which L has its first value again
  const double grey = 0.2, threshold = 0.1, tolerance = 1e-3 * threshold;
  for (const FlickerShape shape : {FlickerShape::mains, FlickerShape::sine}) {
    for (const double depth : {0.5, 0.97, 1.0}) {
      scenario_.light.flicker->shape = shape;
      scenario_.light.flicker->depth = depth;
      const Modulation light(*scenario_.light.flicker, 0, {});
      const auto L = [&](TimeNs t) { return std::log(grey * light.at(t) + camera().event_camera.log_eps); };
      const std::vector<Event> wanted = crossings(L, 49 * kNsPerMs, threshold);
      ASSERT_GE(wanted.size(), 50U);
      for (const double rate_hz : {100.0, 5000.0}) {
        camera().sampling = UniformSampling{rate_hz};
        const Keeper out = run();
        const std::vector<Event> events = out.of(5, 7);
        ASSERT_EQ(events.size(), wanted.size());
        expect_same_events_of_all_pixels(out);
        std::vector<double> errors;
        for (std::size_t i = 0; i < events.size(); ++i) {
          EXPECT_EQ(events[i].polarity, wanted[i].polarity);
          const double error = static_cast<double>(std::abs(events[i].t - wanted[i].t)) * 1e-9;
          const double slope = (L(wanted[i].t + 500) - L(wanted[i].t - 500)) / 1e-6;
          EXPECT_LE(error, (tolerance + 2e-6) / std::abs(slope) + 2e-9);  // 2e-6: rounding of floats; 2 ns: of times
          errors.push_back(error);
        }
        std::nth_element(errors.begin(), errors.begin() + static_cast<std::ptrdiff_t>(errors.size() / 2), errors.end());
        EXPECT_LT(errors[errors.size() / 2], 1e-6);
      }
    }
  }
}

TEST_F(FlickeringLight, OfSwitchedLampsFiresOnlyAtEdges) {
  take_few_pixels();
  scenario_.light.flicker = kPwm;
  const double grey = 0.2, eps = camera().event_camera.log_eps;
  const int steps = static_cast<int>(std::log((grey / 0.3 + eps) / eps) / 0.1);
  ASSERT_GT(steps, 60);
  std::vector<std::vector<Event>> runs;
  for (const SamplingOptions& sampling :
       {SamplingOptions(UniformSampling{100}), SamplingOptions(UniformSampling{333}),
        SamplingOptions(UniformSampling{5000}), SamplingOptions(AdaptiveSampling{})}) {
    camera().sampling = sampling;
    runs.push_back(run().events);
    EXPECT_EQ(runs.back().size(), 8U * 8 * 50 * 2 * static_cast<unsigned>(steps));
    for (const Event& event : runs.back()) {
      const TimeNs edge = event.polarity > 0 ? 0 : 300'000;  // after the start of a period
      EXPECT_LE(std::abs((event.t + 200'000 - edge + 500'000) % 1'000'000 - 500'000), 1) << event.t;
    }
  }
  for (const std::vector<Event>& other : runs) EXPECT_TRUE(other == runs[0]);  // the complete streams
}

TEST_F(FlickeringLight, LeavesTheEventsOfMotionAsTheyAre) {
  add_moving_card();
  for (const SamplingOptions& sampling : {SamplingOptions(AdaptiveSampling{}), SamplingOptions(UniformSampling{300})}) {
    camera().sampling = sampling;
    scenario_.light.flicker.reset();
    const Keeper constant = run();
    ASSERT_GT(constant.events.size(), 1000U);
    scenario_.light.flicker = FlickerOptions{.depth = 0};
    EXPECT_EQ(run().events, constant.events);
    scenario_.light.flicker = FlickerOptions{1000, 1e-9, FlickerShape::pwm};  // only divides segments
    const std::vector<Event> a = run().by_pixel(), b = constant.by_pixel();
    ASSERT_EQ(a.size(), b.size());
    TimeNs largest = 0;
    for (std::size_t i = 0; i < a.size(); ++i) {
      ASSERT_EQ(std::tuple(a[i].x, a[i].y, a[i].polarity), std::tuple(b[i].x, b[i].y, b[i].polarity));
      largest = std::max(largest, std::abs(a[i].t - b[i].t));
    }
    EXPECT_LT(largest, kNsPerUs);
  }
}

TEST_F(FlickeringLight, IsTheSameWithAnyNumberOfThreadsTilesAndRenderers) {
  add_moving_card();
  mesh().objects[0].flicker = kPwm;
  camera().event_camera = {preset_options("davis346")};
  for (const SamplingOptions& sampling :
       {SamplingOptions(AdaptiveSampling{}), SamplingOptions(FlowSampling{}), SamplingOptions(KeyframeSampling{})}) {
    camera().sampling = sampling;
    const Keeper one = run(1), two = run(2);
    EXPECT_EQ(one.events, two.events);
    EXPECT_GT(one.events.size(), 1000U);
    EXPECT_TRUE(std::is_sorted(one.events.begin(), one.events.end()));
  }
}

TEST_F(FlickeringLight, OfAMovingSceneGivesTheSameEventsWithEverySamplingMethod) {
  add_moving_card();
  camera().sampling = UniformSampling{5000};
  const double dense = static_cast<double>(run().events.size());
  for (const SamplingOptions& sampling :
       {SamplingOptions(AdaptiveSampling{}), SamplingOptions(FlowSampling{}), SamplingOptions(KeyframeSampling{})}) {
    camera().sampling = sampling;
    EXPECT_NEAR(static_cast<double>(run().events.size()) / dense, 1, 0.02);
  }
}

TEST_F(FlickeringLight, OfAnObjectIsSeenOnItOnly) {
  scenario_.light.flicker.reset();
  scenario_.duration_s = 0.02;
  add_card(kPwm);
  for (const SamplingOptions& sampling : {SamplingOptions(AdaptiveSampling{}), SamplingOptions(UniformSampling{70}),
                                          SamplingOptions(KeyframeSampling{})}) {
    camera().sampling = sampling;
    const Keeper out = run();
    const std::size_t in_middle = out.of(32, 24).size();
    EXPECT_GT(in_middle, 1000U);
    EXPECT_EQ(in_middle, out.of(33, 25).size());
    EXPECT_EQ(out.of(3, 3).size(), 0U);
  }
  // An object of constant light in a flickering room.
  scenario_.light.flicker = kPwm;
  add_card(FlickerOptions{.depth = 0});
  const Keeper out = run();
  EXPECT_EQ(out.of(32, 24).size(), 0U);
  EXPECT_GT(out.of(3, 3).size(), 1000U);
}

TEST_F(FlickeringLight, OfASpriteIsSeenOnItOnly) {
  folder_.write(
      "sprite.pgm", "P2\n8 8\n255\n" + [] {
        std::string pixels;
        for (int i = 0; i < 64; ++i) pixels += "128 ";
        return pixels;
      }());
  SpritesRendererOptions sprites;
  SpriteOptions lamp;
  lamp.image = folder_.path() / "sprite.pgm";
  lamp.flicker = kPwm;
  sprites.sprites = {lamp};
  scenario_.renderer = sprites;
  scenario_.light.flicker.reset();
  const Keeper out = run();
  EXPECT_GT(out.of(32, 24).size(), 1000U);
  EXPECT_EQ(out.of(3, 3).size(), 0U);
}

TEST_F(FlickeringLight, IsInGroundTruthAndFrames) {
  scenario_.truth.rate_hz = 130;
  scenario_.duration_s = 0.2;
  camera().events = false;
  FrameCameraOptions frames;
  frames.rate_hz = 40, frames.exposure_s = 0.01, frames.bits = 12;
  for (const FlickerOptions& flicker :
       {FlickerOptions{100, 1, FlickerShape::mains, 0.5, 0.1}, FlickerOptions{200, 1, FlickerShape::pwm, 0.3, 0.2}}) {
    scenario_.light.flicker = flicker;
    camera().frame_camera = frames;
    const Modulation light(flicker, 0, {});
    const Keeper whole = run();
    ASSERT_EQ(whole.images.size(), 27U);
    for (const auto& [t, image] : whole.images) {
      for (const float pixel : image.pixels()) EXPECT_NEAR(pixel, 0.2 * light.at(t), 1e-6);
    }
    ASSERT_EQ(whole.frames.size(), 7U);
    for (const Image<std::uint16_t>& frame : whole.frames) {
      for (const std::uint16_t pixel : frame.pixels()) EXPECT_EQ(pixel, 819);  // 0.2 * 4095
    }

    // A rolling shutter sees bands.
    camera().frame_camera->exposure_s = 0.001;
    camera().frame_camera->line_delay_s = 0.0003;
    camera().frame_camera->saturation_irradiance = 4;
    const Image<std::uint16_t> bands = run().frames.at(2);
    std::vector<int> rows;
    for (int y = 0; y < 48; ++y) {
      const TimeNs middle = 75 * kNsPerMs + to_ns(0.0003 * (y - 23.5));
      double mean = 0;
      for (TimeNs t = -499'995; t < 500'000; t += 10) mean += light.at(middle + t) / 100'000;
      for (int x = 0; x < 64; ++x) EXPECT_NEAR(bands(x, y), 0.05 * mean * 4095, 0.52) << y;  // 0.5: rounding
      rows.push_back(bands(9, y));
    }
    EXPECT_GT(*std::max_element(rows.begin(), rows.end()), 3 * *std::min_element(rows.begin(), rows.end()));
  }
}

TEST_F(FlickeringLight, OfAnObjectIsInItsPixelsOfFramesAndGroundTruth) {
  scenario_.light.flicker.reset();
  scenario_.truth.rate_hz = 40;
  scenario_.duration_s = 0.2;
  camera().events = false;
  add_card(kPwm);
  FrameCameraOptions frames;
  frames.rate_hz = 40, frames.bits = 12, frames.saturation_irradiance = 4;
  for (const SamplingOptions& sampling : {SamplingOptions(AdaptiveSampling{}), SamplingOptions(UniformSampling{70})}) {
    camera().sampling = sampling;
    for (const double exposure_s : {0.001, 0.0002}) {  // a period; a part of it in which the card is on
      frames.exposure_s = exposure_s;
      camera().frame_camera = frames;
      const Keeper out = run();
      ASSERT_EQ(out.frames.size(), 7U);
      const double card = exposure_s == 0.001 ? 1 : 1 / 0.3;
      for (const Image<std::uint16_t>& frame : out.frames) {
        EXPECT_NEAR(frame(32, 24), card / 4 * 4095, 0.51);
        EXPECT_NEAR(frame(3, 3), 0.2 / 4 * 4095, 0.51);
      }
      for (const auto& [t, image] : out.images) {
        EXPECT_NEAR(image(32, 24), 1 / 0.3, 1e-5);
        EXPECT_NEAR(image(3, 3), 0.2, 1e-6);
      }
    }
  }
}

TEST_F(FlickeringLight, ThatGoesDarkIsSeenByEverySensor) {
  scenario_.light.flicker = kPwm;
  scenario_.duration_s = 0.02;
  take_few_pixels();
  const auto check = [&](const std::string& name) {
    const Keeper out = run();
    EXPECT_GT(out.events.size(), 100U) << name;
    EXPECT_TRUE(std::is_sorted(out.events.begin(), out.events.end())) << name;
    for (const Event& event : out.events) ASSERT_TRUE(event.t >= 0 && event.t <= 20 * kNsPerMs) << name;
  };
  for (const std::string& name : SensorPreset::names()) {
    camera().event_camera = {preset_options(name)};
    check(name);
  }
  camera().event_camera = {};
  camera().event_camera.surround_px = 2, camera().event_camera.surround_ms = 1;
  check("surround");
  camera().event_camera = {};
  camera().event_camera.log_eps = 1e-30;
  check("log_eps");
}

TEST_F(FlickeringLight, OfTheHighestFrequencyIsSeen) {
  scenario_.duration_s = 0.0005;
  take_few_pixels();
  scenario_.light.flicker = FlickerOptions{1e6, 1, FlickerShape::pwm, 0.5, 0};
  EXPECT_GT(run().of(5, 5).size(), 499U * 2 * 50);
  scenario_.light.flicker->shape = FlickerShape::mains;
  EXPECT_GT(run().of(5, 5).size(), 499U * 2 * 10);
}

TEST_F(FlickeringLight, IsRefusedIfItsOptionsAreInvalid) {
  scenario_.light.flicker = FlickerOptions{1e6, 1, FlickerShape::pwm, 0.001};
  EXPECT_TRUE(test::contains(error(), "light.flicker.duty: 0.001 at 1000000 Hz gives pulses"));
  scenario_.light.flicker.reset();
  add_card(FlickerOptions{100, 1, FlickerShape::pwm, 0});
  EXPECT_TRUE(test::contains(error(), "renderer.objects.0.flicker.duty: must be above 0"));
}

TEST(FlickerOptions, AreReadAndChecked) {
  ScenarioText text;
  text.yaml = "renderer: {type: sprites, sprites: [{image: a.png, flicker: {frequency_hz: 60}}]}\nduration_s: 1\n";
  text.file = "s.yaml";
  text.overrides = {"light.flicker={}"};
  const Scenario scenario = read_scenario(text);
  ASSERT_TRUE(scenario.light.flicker);
  EXPECT_EQ(scenario.light.flicker->frequency_hz, 100);
  EXPECT_EQ(std::get<SpritesRendererOptions>(scenario.renderer).sprites[0].flicker->frequency_hz, 60);
  text.overrides = {"light.flicker.shape=pwm"};
  EXPECT_EQ(read_scenario(text).light.flicker->shape, FlickerShape::pwm);
  for (const char* bad : {"frequency_hz=-1", "frequency_hz=0", "frequency_hz=1e7", "frequency_hz=.nan", "depth=1.5",
                          "depth=-0.1", "duty=2", "duty=-1", "phase=2", "shape=square", "frequency=3"}) {
    text.overrides = {std::string("light.flicker.") + bad};
    const std::string message = test::message_of<UserError>([&] { read_scenario(text); });
    const std::string name(bad, std::string(bad).find('='));
    EXPECT_TRUE(test::contains(message, "light.flicker." + name)) << message;
    EXPECT_EQ(message.find('\n'), std::string::npos);
  }
}

}  // namespace
}  // namespace esim
