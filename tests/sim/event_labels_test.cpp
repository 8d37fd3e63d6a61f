// Labels of the events of whole simulations: the objects that pixels saw, against the renderer.
#include <gtest/gtest.h>

#include <array>
#include <map>
#include <set>

#include "esim/sim/flicker_labels.h"
#include "esim/truth/seen_objects.h"
#include "sim/card_scene.h"

namespace esim {
namespace {

class Collector final : public Sink {
 public:
  void begin(const RecordingInfo& recording) override { info = recording; }
  void write(const Record& record) override {
    const auto* const part = std::get_if<EventsRecord>(&record);
    if (part == nullptr) return;
    events.insert(events.end(), part->events.begin(), part->events.end());
    labels.insert(labels.end(), part->labels.begin(), part->labels.end());
    aligned &= part->labels.size() == part->events.size();
  }
  void end(bool) override {}

  RecordingInfo info;
  std::vector<Event> events;
  std::vector<EventLabel> labels;
  bool aligned = true;
};

/// Two cards that cross the view in opposite directions, one before the other.
class SeenCards : public test::CardScene {
 protected:
  SeenCards() {
    folder_.write("other.txt", "0 -0.5 1 0 0 0 0 1\n0.5 -0.5 0 0 0 0 0 1\n1 -0.5 -1 0 0 0 0 1\n");
    FileTrajectoryOptions path;
    path.path = folder_.path() / "other.txt";
    mesh().objects.push_back({"other card", folder_.path() / "card.obj", 1.0, path});
    scenario_.duration_s = 1.0;
    scenario_.cameras[0].event_camera.labels = true;
  }

  Collector run(int threads = 1) {
    Collector out;
    simulate_into(out, threads);
    return out;
  }

  /// The object of each pixel at `t`, rendered.
  Image<std::uint16_t> objects_at(World& world, TimeNs t) {
    RenderRequest request = view(world, 0, t);
    request.which_objects = true;
    Sample sample;
    world.cameras[0].renderer->render(std::move(request), sample);
    return sample.object;
  }
};

TEST_F(SeenCards, AreThoseOfTheNearestSample) {
  constexpr TimeNs kInterval = 2 * kNsPerMs;
  scenario_.cameras[0].sampling = UniformSampling{.rate_hz = 500};
  const Collector out = run();
  EXPECT_TRUE(out.info.cameras[0].has_labels);
  EXPECT_TRUE(out.aligned);
  EXPECT_EQ(out.info.objects, (std::vector<std::string>{"card", "other card"}));
  World world = build_world(scenario_, 1, {[](const std::string&) {}, [](const std::string&) {}});
  std::map<TimeNs, Image<std::uint16_t>> rendered;
  std::array<std::size_t, 3> counts{};
  for (std::size_t i = 0; i < out.events.size(); ++i) {
    const TimeNs nearest = (out.labels[i].t_ideal + kInterval / 2) / kInterval * kInterval;
    if (!rendered.contains(nearest)) rendered.emplace(nearest, objects_at(world, nearest));
    ASSERT_EQ(out.labels[i].object, rendered.at(nearest)(out.events[i].x, out.events[i].y)) << i;
    ++counts.at(out.labels[i].object);
  }
  for (const std::size_t count : counts) EXPECT_GT(count, 100U);
}

TEST_F(SeenCards, AreSeenBetweenTheSamplesOfEachPixel) {
  for (const SamplingOptions& sampling : {SamplingOptions(FlowSampling{}), SamplingOptions(AdaptiveSampling{})}) {
    scenario_.cameras[0].sampling = sampling;
    const Collector out = run(2);
    EXPECT_TRUE(out.aligned);
    World world = build_world(scenario_, 1, {[](const std::string&) {}, [](const std::string&) {}});
    // At 88 to 176 px/s, samples of moving pixels are less than a pixel apart.
    constexpr TimeNs kNear = 12 * kNsPerMs;
    std::size_t compared = 0;
    for (std::size_t i = 0; i < out.events.size(); i += 29) {
      std::set<std::uint16_t> seen;
      for (const TimeNs off : {-kNear, -kNear / 2, TimeNs{0}, kNear / 2, kNear}) {
        const TimeNs t = std::clamp<TimeNs>(out.labels[i].t_ideal + off, 0, kNsPerSecond);
        seen.insert(objects_at(world, t)(out.events[i].x, out.events[i].y));
      }
      EXPECT_TRUE(seen.contains(out.labels[i].object)) << i;
      ++compared;
    }
    EXPECT_GT(compared, 20U);
  }
}

TEST_F(SeenCards, DoNotDependOnThreadsAndNeverChangeTheEvents) {
  const Collector one = run(1), two = run(2);
  EXPECT_EQ(one.events, two.events);
  EXPECT_EQ(one.labels, two.labels);
  scenario_.cameras[0].event_camera.labels = false;
  const Collector plain = run();
  EXPECT_EQ(plain.events, one.events);
  EXPECT_TRUE(plain.labels.empty());
  EXPECT_FALSE(plain.info.cameras[0].has_labels);
}

TEST_F(SeenCards, PassTheFiltersOfTheSensorWithTheirEvents) {
  const Collector all = run();
  scenario_.cameras[0].event_camera.filters.region = RegionFilterOptions{false, {{10, 5, 30, 40}}, {}};
  const Collector passed = run();
  EXPECT_TRUE(passed.aligned);
  Collector expected;
  for (std::size_t i = 0; i < all.events.size(); ++i) {
    const Event& e = all.events[i];
    if (e.x >= 10 && e.x < 40 && e.y >= 5 && e.y < 45)
      expected.events.push_back(e), expected.labels.push_back(all.labels[i]);
  }
  EXPECT_EQ(passed.events, expected.events);
  EXPECT_EQ(passed.labels, expected.labels);
}

TEST_F(SeenCards, SaysWhichEventsFlickerMakes) {
  scenario_.light.flicker = FlickerOptions{.depth = 0.6, .shape = FlickerShape::sine};
  const Collector lit = run();
  ASSERT_TRUE(lit.aligned);
  std::array<std::size_t, 4> causes{};
  for (const EventLabel& label : lit.labels) ++causes.at(static_cast<std::size_t>(label.cause));
  // ln 1.6 / 0.4 = 1.39 up and down, 100 times a second
  EXPECT_GT(causes[1], 9 * causes[0]);
  EXPECT_GT(causes[0], 100U) << "edges of the cards still make events";
  scenario_.light.flicker = FlickerOptions{.depth = 0.001, .shape = FlickerShape::sine};
  const Collector dim = run();
  for (const EventLabel& label : dim.labels) {
    ASSERT_EQ(label.cause, EventCause::signal);
    ASSERT_LE(std::abs(label.flicker), 0.0021F);
  }
}

TEST(FlickerLabels, TakeTheChangeOfTheLightOutOfTheSignal) {
  SceneLight light(Modulation(FlickerOptions{.depth = 0.5, .shape = FlickerShape::sine}, 0, {1e-4, 0.001}));
  const double before = std::log(light.at(0) + 0.001), after = std::log(light.at(2 * kNsPerMs) + 0.001);
  const auto change = static_cast<float>(after - before);
  const Flicker flicker(std::move(light), 0.001);
  FlickerLabels labels(2, 1, 0);
  const std::array<Event, 3> events{{{2 * kNsPerMs, 0, 0, 1}, {2 * kNsPerMs, 1, 0, -1}, {2 * kNsPerMs, 0, 0, 1}}};
  std::array<EventLabel, 3> found;
  for (EventLabel& label : found) label.t_ideal = 2 * kNsPerMs;
  ASSERT_GT(change, 0.1F);
  found[0].signal = 1.5F * change, found[1].signal = -0.2F, found[2].signal = 0.2F;
  labels.set(flicker, events, found);
  EXPECT_NEAR(found[0].flicker, change, 1e-6F);
  EXPECT_NEAR(found[0].signal, 0.5F * change, 1e-6F);
  EXPECT_EQ(found[0].cause, EventCause::flicker);
  EXPECT_EQ(found[1].flicker, 0.0F) << "brighter light makes no OFF event";
  EXPECT_EQ(found[1].signal, -0.2F);
  EXPECT_EQ(found[2].flicker, 0.0F) << "no time since the previous event";
}

TEST(SeenObjects, AreThoseOfTheNearestSampleOfThePixel) {
  SeenObjects seen(4, 2);
  const Image<std::uint16_t> none(4, 2), first(4, 2, std::uint16_t{1}), second(4, 2, std::uint16_t{2});
  const std::array<Tile, 1> all{{{0, 0, 4, 2}}}, left{{{0, 0, 2, 2}}};
  EXPECT_EQ(seen.at(0, 0, 5), 0);
  seen.add(first, 100, all);
  EXPECT_EQ(seen.at(3, 1, 0), 1) << "before the first sample";
  seen.add(second, 200, left);
  EXPECT_EQ(seen.at(0, 1, 149), 1);
  EXPECT_EQ(seen.at(0, 1, 150), 2);
  EXPECT_EQ(seen.at(2, 1, 1000), 1) << "not sampled again";
  seen.add(none, 150, left);
  EXPECT_EQ(seen.at(0, 0, 1000), 2) << "an earlier sample is ignored";
  seen.add(none, 300, all);
  EXPECT_EQ(seen.at(0, 0, 249), 2);
  EXPECT_EQ(seen.at(0, 0, 250), 0);
  EXPECT_EQ(seen.at(2, 0, 199), 1);
  EXPECT_EQ(seen.at(2, 0, 200), 0);
  seen.add({}, 400, all);
  seen.forget_before(210);
  EXPECT_EQ(seen.at(0, 0, 210), 2);
  EXPECT_EQ(seen.at(0, 0, 260), 0);
  EXPECT_EQ(seen.at(2, 0, 260), 0);
  seen.add(first, 400, all);
  EXPECT_EQ(seen.at(2, 0, 349), 0);
  EXPECT_EQ(seen.at(2, 0, 350), 1);
}

TEST(SeenObjects, ForgetWhatIsNoLongerNeeded) {
  SeenObjects seen(1024, 1024);
  const std::array<Tile, 1> all{{{0, 0, 1024, 1024}}};
  TimeNs t = 0;
  for (std::uint16_t k = 1; !seen.is_long(); ++k) {
    ASSERT_LT(k, 10) << "memory is bounded";
    seen.add(Image<std::uint16_t>(1024, 1024, k), t += 100, all);
  }
  seen.forget_before(t);
  EXPECT_FALSE(seen.is_long());
}

}  // namespace
}  // namespace esim
