#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <limits>
#include <random>
#include <thread>

#include "esim/formats/ros/messages/messages.h"
#include "esim/geometry/so3.h"
#include "esim/live/foxglove_server.h"
#include "esim/live/playback.h"
#include "esim/live/pose_input.h"

namespace esim {
namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point begin) { return std::chrono::duration<double>(Clock::now() - begin).count(); }

TEST(Playback, FollowsTheWallClock) {
  for (const double speed : {0.5, 1.0, 4.0}) {
    Playback playback(speed);
    playback.begin(7);
    const Clock::time_point began = Clock::now();
    for (int k = 0; k <= 20; ++k) EXPECT_EQ(playback.wait_until(7 + to_ns(0.01 * k * speed)), Playback::Order::go_on);
    EXPECT_GE(seconds_since(began), 0.2);
    EXPECT_LT(seconds_since(began), 1);
    EXPECT_EQ(playback.now(), 7 + to_ns(0.2 * speed));
  }
}

TEST(Playback, DoesNotWaitWithoutASpeed) {
  Playback playback(0);
  playback.begin(0);
  const Clock::time_point began = Clock::now();
  for (int k = 0; k < 1000; ++k) playback.wait_until(k * kNsPerSecond);
  EXPECT_LT(seconds_since(began), 5);
}

TEST(Playback, DoesNotCatchUp) {
  Playback playback(1);
  playback.begin(0);
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  playback.wait_until(to_ns(0.01));  // late: from now on, this is now
  const Clock::time_point began = Clock::now();
  playback.wait_until(to_ns(0.11));
  EXPECT_GE(seconds_since(began), 0.09);
}

TEST(Playback, PausesStepsAndStops) {
  Playback playback(0);
  playback.set_paused(true);
  playback.begin(0);
  EXPECT_TRUE(playback.paused());
  TimeNs reached = -1;
  auto last = Playback::Order::go_on;
  std::thread simulation([&] {
    for (TimeNs t = 0; last == Playback::Order::go_on; t += kNsPerMs) {
      last = playback.wait_until(t);
      reached = t;
    }
  });
  std::this_thread::sleep_for(std::chrono::milliseconds(50));
  EXPECT_EQ(playback.now(), 0);
  playback.step(0.02);
  for (const Clock::time_point began = Clock::now(); !playback.paused() && seconds_since(began) < 10;)
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  EXPECT_TRUE(playback.paused());
  EXPECT_EQ(playback.now(), to_ns(0.02));
  playback.restart();
  simulation.join();
  EXPECT_EQ(last, Playback::Order::restart);
  EXPECT_EQ(reached, to_ns(0.02));
  playback.begin(0);
  playback.stop();
  EXPECT_EQ(playback.wait_until(0), Playback::Order::stop);
  playback.restart();  // does not undo it
  EXPECT_EQ(playback.wait_until(0), Playback::Order::stop);
}

std::string in_cdr(const SE3& pose) {
  std::string payload;
  formats::ros::MessageWriter(formats::ros::Encoding::cdr, payload)(formats::ros::PoseMessage{{}, pose});
  return payload;
}

ClientMessage pose_message(const SE3& pose) {
  return {"/esim/pose", "cdr", "geometry_msgs/msg/PoseStamped", in_cdr(pose)};
}

TEST(PoseInput, PosesHoldAndTwistsMove) {
  PoseInput input(1);
  const SE3 start{so3_exp({0, 0, 0.3}), {1, 2, 3}};
  input.begin(start);
  EXPECT_EQ(input.next(start, 0.1).translation, start.translation);
  const SE3 wanted{so3_exp({0.1, 0, 0.3}), {1.5, 2, 3}};
  input.take(pose_message(wanted));
  for (int k = 0; k < 3; ++k) EXPECT_LT((input.next(start, 0.1).translation - wanted.translation).norm(), 1e-12);
  input.take(
      {"/esim/twist", "json", "", R"({"linear": {"x": 2, "y": 0, "z": 0}, "angular": {"x": 0, "y": 0, "z": 1}})"});
  const SE3 moved = input.next(wanted, 0.1);
  EXPECT_LT((moved.translation - (wanted * Eigen::Vector3d(0.2, 0, 0))).norm(), 1e-12);
  EXPECT_LT(so3_log((wanted.rotation * so3_exp({0, 0, 0.1})).conjugate() * moved.rotation).norm(), 1e-9);
  EXPECT_EQ(input.taken(), 2);
  EXPECT_EQ(input.refused(), 0);
}

TEST(PoseInput, CountsWhatItRefuses) {
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  PoseInput input(1);
  input.begin({});
  std::int64_t refused = 0;
  const auto refuses = [&](const ClientMessage& message) {
    input.take(message);
    EXPECT_EQ(input.refused(), ++refused) << message.payload;
    EXPECT_EQ(input.next({}, 1).translation, Eigen::Vector3d::Zero());
  };
  refuses(pose_message({Eigen::Quaterniond::Identity(), {0, 0, 1.1}}));
  refuses(pose_message({Eigen::Quaterniond::Identity(), {kNaN, 0, 0}}));
  refuses(pose_message({Eigen::Quaterniond(0, 0, 0, 0), {0, 0, 0}}));
  refuses(pose_message({Eigen::Quaterniond(kNaN, 0, 0, 0), {0, 0, 0}}));
  const std::string whole = in_cdr({});
  for (std::size_t size = 0; size < whole.size(); ++size) refuses({"/esim/pose", "cdr", "", whole.substr(0, size)});
  for (const char* text : {"", "{", "3", "[]", "null", R"({"position": {}})", R"({"pose": {"position": {"x": "1"}}})"})
    refuses({"/esim/pose", "json", "", text});
  refuses(
      {"/esim/twist", "json", "", R"({"linear": {"x": 1e300, "y": 0, "z": 0}, "angular": {"x": 0, "y": 0, "z": 0}})"});
  input.take({"/other", "json", "", "{}"});
  EXPECT_EQ(input.refused(), refused);
  EXPECT_EQ(input.taken(), 0);
  std::mt19937 random(1);
  for (int k = 0; k < 2000; ++k) {  // any bytes: no crash, and finite poses
    std::string payload = whole;
    for (int n = 0; n < 4; ++n) payload[random() % payload.size()] = static_cast<char>(random());
    input.take({"/esim/pose", "cdr", "", payload});
    const SE3 pose = input.next({}, 0.01);
    ASSERT_TRUE(pose.translation.allFinite() && std::abs(pose.rotation.norm() - 1) < 1e-6);
  }
}

// Publishing from several threads while the server begins and ends; clients are tested in tests/cli/serve_test.py.
TEST(FoxgloveServer, PublishesFromAnyThread) {
  for (int round = 0; round < 5; ++round) {
    FoxgloveServer server({.host = "127.0.0.1", .port = 0}, {}, {});
    EXPECT_GT(server.port(), 0);
    std::vector<std::thread> threads;
    for (int k = 0; k < 3; ++k) {
      threads.emplace_back([&server, k] {
        const std::uint32_t channel = server.advertise({"/topic" + std::to_string(k % 2), "a/msg/B", "", true});
        for (int i = 0; i < 200; ++i) server.publish(channel, i, std::string(1000, 'x'));
        server.publish_time(k);
      });
    }
    for (std::thread& thread : threads) thread.join();
    EXPECT_EQ(server.advertise({"/topic0", "a/msg/B", "", true}), server.advertise({"/topic0", "a/msg/B", "", true}));
    EXPECT_EQ(server.dropped(), 0);
  }
}

}  // namespace
}  // namespace esim
