#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "esim/compose/waypoint_trajectory.h"
#include "esim/scenario/read.h"
#include "esim/studio/editor/motion_warnings.h"
#include "esim/studio/editor/scenario_check.h"
#include "esim/studio/endpoints/endpoints.h"

namespace esim::studio {
namespace {

std::vector<TimeNs> even_times(const TimeSpan& span, int count) {
  std::vector<TimeNs> times;
  for (int i = 0; i < count; ++i) {
    times.push_back(span.start + static_cast<TimeNs>(static_cast<double>(span.end - span.start) * i / (count - 1)));
  }
  return times;
}

/// The waypoints with their poses and times in the motion; null if the motion has none.
Json waypoints_json(const Scenario& scenario, const CameraInfo& camera) {
  const auto* const options = std::get_if<WaypointTrajectoryOptions>(&scenario.trajectory);
  if (options == nullptr) return nullptr;
  const WaypointTrajectory motion = waypoint_trajectory(*options, camera.T_body_camera, "trajectory");
  const std::vector<TimeNs> arrivals = motion.arrivals();
  Json points = Json::array();
  for (std::size_t i = 0; i < options->points.size(); ++i) {
    const WaypointPointOptions& point = options->points[i];
    Json entry{{"pose", json_of(motion.at(arrivals[i]).T_world_body)}, {"t", arrivals[i]}};
    if (point.look_at) entry["look_at"] = json_of(*point.look_at);
    if (point.speed) entry["speed"] = *point.speed;
    if (point.pause_s) entry["pause_s"] = *point.pause_s;
    points.push_back(std::move(entry));
  }
  return points;
}

Json trajectory_json(const Json& request, const Workshop& workshop) {
  constexpr double kMaxSamples = 20'000, kDefaultSamples = 400, kDegree = std::numbers::pi / 180;
  const auto samples = static_cast<int>(number_member(request, "samples", kDefaultSamples, 2, kMaxSamples));
  const Scenario scenario = scenario_of(request, workshop.roots, ScenarioNeeds::motion);
  const bool engine = engine_objects(scenario.renderer) != nullptr;
  const auto scene = engine ? nullptr : workshop.scenes.of(scenario);
  static const SceneFile kNothing;
  const SceneFile& file = engine ? kNothing : scene->file();
  const StudioMotion motion = motion_of(scenario, file);

  Json answer{{"start", motion.simulated.start}, {"end", motion.simulated.end}};
  std::vector<MotionSample> course;
  Json t = Json::array(), poses = t, speed = t, turn = t, acceleration = t;
  for (const TimeNs time : even_times({motion.body->start(), motion.body->end()}, samples)) {
    const Kinematics body = motion.body->at(time);
    course.push_back({time, body});
    t.push_back(time);
    poses.push_back(json_of(body.T_world_body));
    speed.push_back(body.velocity_world.norm());
    turn.push_back(body.omega_body.norm() / kDegree);
    acceleration.push_back(body.acceleration_world.norm());
  }
  answer["t"] = std::move(t);
  answer["poses"] = std::move(poses);
  answer["speed_m_per_s"] = std::move(speed);
  answer["turn_deg_per_s"] = std::move(turn);
  answer["acceleration"] = std::move(acceleration);
  const CameraInfo camera = cameras_of(scenario, file).front();
  answer["T_body_camera"] = json_of(camera.T_body_camera);
  answer["warnings"] = Json::array();
  for (const MotionWarning& warning : motion_warnings(course, camera.T_body_camera, file.scene))
    answer["warnings"].push_back({{"from", warning.from}, {"to", warning.to}, {"what", warning.what}});
  answer["waypoints"] = waypoints_json(scenario, camera);
  answer["objects"] = Json::array();
  for (std::size_t i = 0; i < motion.objects.size(); ++i) {
    Json object{{"name", motion.names[i]}, {"t", Json::array()}, {"poses", Json::array()}};
    for (const TimeNs time : even_times(motion.simulated, samples)) {
      object["t"].push_back(time);
      object["poses"].push_back(json_of(motion.objects[i]->at(time).T_world_body));
    }
    answer["objects"].push_back(std::move(object));
  }
  return answer;
}

}  // namespace

void add_motion(Router& router, const Workshop& workshop) {
  router.add("POST", "/api/trajectory", [workshop](const Request& request) {
    return json_response(trajectory_json(parse_object(request.body), workshop));
  });
}

}  // namespace esim::studio
