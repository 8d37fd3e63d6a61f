// Closed-loop simulation: a quadrotor flies a figure eight with its simulated IMU and a noisy position fix five times a
// second, while an event camera looks down. Writes the recording, and the paths as path.png.
#include <esim/compose/compose.h>
#include <esim/core/error.h>
#include <esim/motion/online.h>
#include <esim/recording/fan_out.h>
#include <esim/recording/recording_directory.h>
#include <esim/scenario/read.h>

#include <cmath>
#include <cstdio>
#include <random>

#include "figure.h"
#include "pilot.h"

namespace {

/// Forwards the IMU's measurements.
class ImuTap final : public esim::Sink {
 public:
  explicit ImuTap(Estimator& estimator) : estimator_(estimator) {}

  void begin(const esim::RecordingInfo&) override {}
  void write(const esim::Record& record) override {
    if (const auto* imu = std::get_if<esim::ImuRecord>(&record)) estimator_.predict(*imu);
  }
  void end(bool) override {}

 private:
  Estimator& estimator_;
};

double rms_distance(const std::vector<Eigen::Vector3d>& a, const std::vector<Eigen::Vector3d>& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += (a[i] - b[i]).squaredNorm();
  return std::sqrt(sum / static_cast<double>(a.size()));
}

int fly(const std::string& scenario_file, const std::string& out, const std::vector<std::string>& overrides) {
  constexpr esim::TimeNs kStep = 2 * esim::kNsPerMs, kFixInterval = 200 * esim::kNsPerMs;
  constexpr double kFixSigma_m = 0.02, kLost_m = 0.5;
  const esim::Scenario scenario = esim::read_scenario(scenario_file, overrides);
  const auto* take_off = std::get_if<esim::StaticTrajectoryOptions>(&scenario.trajectory);
  if (take_off == nullptr || !scenario.imu)
    throw esim::UserError(scenario_file + ": must have a static trajectory, which is the take-off pose, and an imu");
  const esim::SE3 initial = esim::pose_of(take_off->pose);

  const auto motion = std::make_shared<esim::OnlineTrajectory>(esim::OnlineMotionOptions{.interval = kStep}, initial);
  const esim::NoticeHandler say = [](const std::string& text) { std::printf("%s\n", text.c_str()); };
  esim::World world = esim::build_world(scenario, motion, 0, {say, say});
  Vehicle vehicle(initial);
  Estimator estimator(initial, *scenario.imu);
  esim::RecordingDirectory directory(out, true);
  esim::FanOut sinks;
  sinks.add(esim::build_sink(scenario, directory.path()));
  sinks.add(std::make_unique<ImuTap>(estimator));
  esim::Simulator simulator(world, sinks);
  const esim::Monitor go_on = [](const esim::Progress&) { return true; };

  std::mt19937_64 random(scenario.seed);
  std::normal_distribution<double> fix_error(0, kFixSigma_m);
  Flight flight;
  for (esim::TimeNs next_fix = 0; motion->final_until() <= world.info.end;) {
    // The sensors' measurements so far.
    simulator.advance_until(motion->final_until(), go_on);
    const esim::TimeNs now = estimator.time();
    const Eigen::Vector3d position = motion->at(now).T_world_body.translation;
    if (now >= next_fix) {
      estimator.correct(position + Eigen::Vector3d(fix_error(random), fix_error(random), fix_error(random)),
                        kFixSigma_m);
      next_fix += kFixInterval;
    }
    // The pilot's command and the resulting motion of the vehicle.
    const Waypoint goal = figure_eight(initial.translation, esim::to_seconds(now));
    vehicle.step(steer(goal, estimator), esim::to_seconds(kStep));
    motion->push(vehicle.pose());
    flight.commanded.push_back(goal.position);
    flight.flown.push_back(position);
    flight.estimated.push_back(estimator.pose().translation);
  }
  const esim::Summary summary = simulator.finish();
  draw(flight, directory.path() / "path.png");
  directory.finish(esim::report_json(scenario, summary, world.workers->threads(), {}));

  const double off_path_m = rms_distance(flight.flown, flight.commanded);
  std::printf("flown for %.1f s, %.1f cm rms off the commanded path; estimated to %.1f cm rms; %lld events\n",
              esim::to_seconds(summary.end - summary.start), 100 * off_path_m,
              100 * rms_distance(flight.flown, flight.estimated), static_cast<long long>(summary.cameras[0].events()));
  std::printf("recording: %s\n", out.c_str());
  return summary.complete && off_path_m < kLost_m ? 0 : 1;
}

}  // namespace

int main(int count, char** arguments) {
  if (count < 3) {
    std::fprintf(stderr, "usage: quadrotor SCENARIO.yaml OUT [key=value ...]\n");
    return 2;
  }
  try {
    return fly(arguments[1], arguments[2], {arguments + 3, arguments + count});
  } catch (const std::exception& error) {
    std::fprintf(stderr, "error: %s\n", error.what());
    return 1;
  }
}
