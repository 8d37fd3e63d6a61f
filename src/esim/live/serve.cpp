#include "esim/live/serve.h"

#include <fmt/format.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "esim/core/error.h"
#include "esim/live/live_sink.h"
#include "esim/live/playback.h"
#include "esim/live/pose_input.h"
#include "esim/motion/online.h"
#include "esim/sim/simulate.h"

namespace esim::inline live {
namespace {

constexpr double kMaxSpeed = 1000, kMaxStep_s = 1e6, kDay_s = 86400;

}  // namespace

struct Server::Impl {
  Impl(const Scenario& simulated, const ServeOptions& chosen)
      : scenario(simulated),
        options(chosen),
        playback(chosen.speed),
        poses(chosen.max_jump_m),
        ros2(chosen.ros2 ? std::make_unique<Ros2Publication>(
                               *chosen.ros2, [this](const ClientMessage& message) { poses.take(message); })
                         : nullptr),
        server(chosen.place, {},
               {.message = [this](const ClientMessage& message) { poses.take(message); },
                .parameters = [this] { return parameters(); },
                .set = [this](const Parameter& parameter) { return set(parameter); }}) {
    publications = {&server};
    if (ros2) publications.push_back(ros2.get());
    if (options.paused) playback.set_paused(true);
  }

  std::vector<Parameter> parameters() const;
  std::string set(const Parameter& parameter);
  Playback::Order wait_until(TimeNs now);
  Playback::Order follow_trajectory(const Notices& notices);
  Playback::Order follow_clients(const Notices& notices);

  Scenario scenario;
  ServeOptions options;
  Playback playback;
  PoseInput poses;
  std::atomic<std::int64_t> refused_turns{0};
  std::chrono::steady_clock::time_point told{};  // the parameters
  std::shared_ptr<const LoadedScene> scene;      // if clients move the body; loaded once
  std::unique_ptr<Ros2Publication> ros2;         // null: without. Its thread uses the poses
  FoxgloveServer server;                         // its thread uses all above
  std::vector<Publication*> publications;
};

std::vector<Parameter> Server::Impl::parameters() const {
  const auto number = [](std::int64_t value) { return static_cast<double>(value); };
  return {{"paused", playback.paused()},
          {"speed", playback.speed()},
          {"step_s", 0.0},
          {"restart", false},
          {"time_s", to_seconds(playback.now())},
          {"clock_s", to_seconds(playback.due())},
          {"real_time_factor", playback.real_time_factor()},
          {"dropped_messages", number(server.dropped() + (ros2 ? ros2->dropped() : 0))},
          {"poses", number(poses.taken())},
          {"refused_poses", number(poses.refused() + refused_turns)}};
}

std::string Server::Impl::set(const Parameter& parameter) {
  const bool* const flag = std::get_if<bool>(&parameter.value);
  const double* const number = std::get_if<double>(&parameter.value);
  if (parameter.name == "paused") {
    if (flag == nullptr) return "parameter paused: must be true or false";
    playback.set_paused(*flag);
  } else if (parameter.name == "speed") {
    if (number == nullptr || !(*number >= 0 && *number <= kMaxSpeed))
      return fmt::format("parameter speed: must be from 0 (as fast as possible) to {}", kMaxSpeed);
    playback.set_speed(*number);
  } else if (parameter.name == "step_s") {
    if (number == nullptr || !(*number > 0 && *number <= kMaxStep_s))
      return "parameter step_s: must be above 0: the time to simulate before the next pause, s";
    playback.step(*number);
  } else if (parameter.name == "restart") {
    if (flag == nullptr) return "parameter restart: must be true";
    if (*flag) playback.restart();
  } else {
    return fmt::format("parameter {}: cannot be set; those that can are paused, speed, step_s, restart",
                       parameter.name.substr(0, 100));
  }
  return {};
}

Playback::Order Server::Impl::wait_until(TimeNs now) {
  const auto wall = std::chrono::steady_clock::now();
  if (wall - told >= std::chrono::seconds(1)) {
    told = wall;
    server.send_parameters();
  }
  return playback.wait_until(now);
}

/// Simulates once.
Playback::Order Server::Impl::follow_trajectory(const Notices& notices) {
  World world = build_world(scenario, options.threads, notices);
  const std::unique_ptr<Sink> sink = make_live_sink(publications);
  playback.begin(world.info.start);
  auto order = Playback::Order::go_on;
  const Summary summary = simulate(world, *sink, [&](const Progress& progress) {
    order = wait_until(progress.now);
    return order == Playback::Order::go_on;
  });
  if (!summary.problem.empty()) throw UserError(summary.problem);
  return order;
}

/// Simulates once a body that clients move. Its pose at a time is the one that they want at that time of the clock.
Playback::Order Server::Impl::follow_clients(const Notices& notices) {
  if (scene == nullptr) scene = load_scene(scenario, notices);
  const std::shared_ptr<const Trajectory> planned = build_trajectory(scenario, *scene, notices);
  SE3 body = planned->at(planned->start()).T_world_body;
  poses.begin(body);
  const TimeNs interval = to_ns(options.pose_interval_s);
  const auto motion = std::make_shared<OnlineTrajectory>(OnlineMotionOptions{.start = 0, .interval = interval}, body);
  Scenario lasting = scenario;
  if (!lasting.duration_s) lasting.duration_s = kDay_s;
  World world = build_world(lasting, *scene, motion, options.threads, notices);
  const std::unique_ptr<Sink> sink = make_live_sink(publications);
  Simulator simulator(world, *sink);
  playback.begin(world.info.start);
  auto order = Playback::Order::go_on;
  while (order == Playback::Order::go_on && motion->final_until() < world.info.end) {
    order = wait_until(motion->newest() + interval);
    const SE3 wanted = poses.next(body, options.pose_interval_s);
    try {
      motion->push(wanted);
      body = wanted;
    } catch (const UserError&) {  // a turn of 180 degrees or more
      ++refused_turns;
      motion->push(body);
    }
    simulator.advance_until(world.info.end, [](const Progress&) { return true; });
  }
  simulator.finish();
  return order;
}

Server::Server(const Scenario& scenario, const ServeOptions& options) {
  if (!(options.speed >= 0 && options.speed <= kMaxSpeed))
    throw UserError(fmt::format("speed: must be from 0 (as fast as possible) to {}", kMaxSpeed));
  if (!(options.pose_interval_s >= 1e-4 && options.pose_interval_s <= 1))
    throw UserError("pose interval: must be from 0.0001 to 1 s");
  if (!(options.max_jump_m > 0)) throw UserError("largest jump: must be above 0 m");
  impl_ = std::make_unique<Impl>(scenario, options);
}

Server::~Server() = default;

int Server::port() const { return impl_->server.port(); }

void Server::run(const Notices& notices) {
  Notices once = notices;
  for (;;) {
    const Playback::Order order =
        impl_->options.live_pose ? impl_->follow_clients(once) : impl_->follow_trajectory(once);
    if (order == Playback::Order::stop || (order == Playback::Order::go_on && !impl_->options.loop)) return;
    once = {[](const auto&) {}, [](const auto&) {}};
  }
}

void Server::stop() { impl_->playback.stop(); }

}  // namespace esim::inline live
