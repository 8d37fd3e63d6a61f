#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "esim/compose/compose.h"
#include "esim/core/error.h"
#include "esim/formats/recording_folder/calibration_files.h"
#include "esim/geometry/calibration.h"
#include "esim/motion/imu_kinematics.h"
#include "support/errors.h"
#include "support/temporary_directory.h"

namespace esim {
namespace {

/// Keeps measurements and poses, and checks that all records arrive in order of time.
class Logbook final : public Sink {
 public:
  void begin(const RecordingInfo& recording) override {
    info = recording;
    events.resize(info.cameras.size());
  }
  void write(const Record& record) override {
    std::visit([this](const auto& kind) { keep(kind); }, record);
  }
  void end(bool) override {}

  RecordingInfo info;
  std::vector<ImuRecord> imu;
  std::vector<PoseRecord> poses;
  std::vector<std::vector<Event>> events;  // of each camera

 private:
  void keep(const EventsRecord& record) {
    for (const Event& event : record.events) {
      EXPECT_GE(event.t, now_);
      last_event_ = std::max(last_event_, event.t);
      events[static_cast<std::size_t>(record.camera)].push_back(event);
    }
  }
  void keep(const ImuRecord& record) { imu.push_back(record), pass(record.t); }
  void keep(const PoseRecord& record) { poses.push_back(record), pass(record.t); }
  void keep(const TruthRecord& record) { pass(record.t); }
  template <typename Other>
  void keep(const Other&) {}
  void pass(TimeNs t) {
    EXPECT_GE(t, now_);
    EXPECT_GE(t, last_event_);
    now_ = t;
  }
  TimeNs now_ = 0, last_event_ = 0;
};

/// A random flight in front of sprites on the sensor, which need no files, with an IMU.
Scenario scenario_with_imu() {
  Scenario scenario;
  SpritesRendererOptions renderer;
  scenario.renderer = renderer;
  RandomTrajectoryOptions motion;
  motion.position_amplitude_m = {0.3, 0.2, 0.1};
  motion.rotation_amplitude_deg = {20, 40, 30};
  scenario.trajectory = motion;
  scenario.duration_s = 0.5;
  scenario.seed = 5;
  scenario.imu.emplace();
  scenario.imu->T_body_imu.position = {0.01, 0.02, 0.03};
  scenario.imu->T_body_imu.quaternion = {0.5, 0.5, 0.5, 0.5};
  return scenario;
}

const Notices kQuiet{[](const std::string&) {}, [](const std::string&) {}};
const Monitor kOn = [](const Progress&) { return true; };

class ImuSimulation : public testing::Test {
 protected:
  void SetUp() override {
    std::ofstream(folder_.path() / "p.pgm") << "P2 4 4 255\n0 255 0 255 9 200 30 40 255 0 255 0 90 80 70 60\n";
    std::get<SpritesRendererOptions>(scenario_.renderer).sprites = {sprite()};
    scenario_.cameras.resize(2);
    for (CameraOptions& camera : scenario_.cameras) camera.width = 16, camera.height = 12;
    scenario_.cameras[0].name = "left", scenario_.cameras[1].name = "right";
    scenario_.cameras[1].T_body_camera.position = {0.1, 0, 0};
    scenario_.cameras[1].distortion = RadialTangentialOptions{{-0.1, 0.01, 1e-3, 2e-3, 0}};
    scenario_.cameras[1].sampling = UniformSampling{300};
  }

  SpriteOptions sprite() const {
    SpriteOptions sprite;
    sprite.image = folder_.path() / "p.pgm";
    sprite.units = SpriteUnits::sensor;
    sprite.poses = {SpritePose{}, SpritePose{}};
    sprite.poses[1].t_s = 1;
    sprite.poses[1].position = {0.5, 0.2};
    return sprite;
  }

  Summary run(Logbook& out, int threads = 1) {
    World world = build_world(scenario_, threads, kQuiet);
    trajectory_ = world.trajectory;
    return simulate(world, out, kOn);
  }

  test::TemporaryDirectory folder_;
  Scenario scenario_ = scenario_with_imu();
  std::shared_ptr<const Trajectory> trajectory_;
};

TEST_F(ImuSimulation, MeasuresTheRigsMotionAtItsOwnRate) {
  scenario_.imu->rate_hz = 700;
  scenario_.imu->gyroscope.noise_density = scenario_.imu->gyroscope.random_walk = 0;
  scenario_.imu->accelerometer.noise_density = scenario_.imu->accelerometer.random_walk = 0;
  Logbook out;
  const Summary summary = run(out);
  ASSERT_EQ(out.imu.size(), 351U);
  EXPECT_EQ(summary.imu_samples, 351);
  EXPECT_EQ(nlohmann::json::parse(report_json(scenario_, summary, 1, {})).at("imu_samples"), 351);
  EXPECT_EQ(out.imu[1].t, 1'428'571);
  ASSERT_TRUE(out.info.imu);
  for (const ImuRecord& record : out.imu) {
    const InertialSignals truth = inertial_signals(trajectory_->at(record.t), out.info.imu->T_body_imu, {0, 0, -9.81});
    EXPECT_EQ(record.measured.angular_rate, truth.angular_rate);
    EXPECT_EQ(record.measured.specific_force, truth.specific_force);
  }
  ASSERT_EQ(out.poses.size(), 101U);
  EXPECT_TRUE(out.poses[50].imu_bias);
  EXPECT_EQ(out.poses[50].body.alpha_body, trajectory_->at(out.poses[50].t).alpha_body);
}

TEST_F(ImuSimulation, MeasuresOnceAtARateBeyondTheRangeOfTimes) {
  scenario_.imu->rate_hz = 1e-12;
  Logbook out;
  EXPECT_EQ(run(out).imu_samples, 1);
}

TEST_F(ImuSimulation, IsTheSameWithAnyNumberOfThreadsAndChangesNoEvent) {
  Logbook one, two, without;
  run(one, 1);
  run(two, 2);
  ASSERT_EQ(one.imu.size(), 501U);
  for (std::size_t i = 0; i < one.imu.size(); ++i) {
    EXPECT_EQ(one.imu[i].measured.specific_force, two.imu[i].measured.specific_force);
    EXPECT_EQ(one.imu[i].bias.angular_rate, two.imu[i].bias.angular_rate);
  }
  scenario_.imu.reset();
  run(without);
  EXPECT_TRUE(without.imu.empty());
  EXPECT_GT(one.events[0].size() + one.events[1].size(), 100U);
  EXPECT_EQ(one.events, without.events);
}

TEST_F(ImuSimulation, RecordingsHoldCalibrationsThatReadBackToTheSameRig) {
  const std::unique_ptr<Sink> sink = build_sink(scenario_, folder_.path() / "out");
  World world = build_world(scenario_, 1, kQuiet);
  sink->begin(world.info);
  sink->end(true);
  const auto cameras = read_calibration(folder_.path() / "out/calibration/camchain.yaml");
  ASSERT_EQ(cameras.size(), 2U);
  for (std::size_t i = 0; i < 2; ++i) {
    const CameraInfo& camera = world.info.cameras[i];
    const Eigen::Matrix4d T_imu_camera = (world.info.imu->T_body_imu.inverse() * camera.T_body_camera).matrix();
    EXPECT_LT((cameras[i].T_body_camera.matrix() - T_imu_camera).cwiseAbs().maxCoeff(), 1e-12);
    EXPECT_EQ(cameras[i].model.width, camera.model.width);
    EXPECT_EQ(cameras[i].model.fx, camera.model.fx);
    EXPECT_EQ(cameras[i].model.cy, camera.model.cy);
    EXPECT_EQ(cameras[i].model.distortion.index(), camera.model.distortion.index());
  }
  EXPECT_EQ(std::get<RadialTangential>(cameras[1].model.distortion).p2, 2e-3);
  const CalibratedImu imu = read_imu_calibration(folder_.path() / "out/calibration/imu.yaml");
  EXPECT_EQ(imu.rate_hz, scenario_.imu->rate_hz);
  EXPECT_EQ(imu.gyroscope_noise_density, scenario_.imu->gyroscope.noise_density);
  EXPECT_EQ(imu.gyroscope_random_walk, scenario_.imu->gyroscope.random_walk);
  EXPECT_EQ(imu.accelerometer_noise_density, scenario_.imu->accelerometer.noise_density);
  EXPECT_EQ(imu.accelerometer_random_walk, scenario_.imu->accelerometer.random_walk);
  EXPECT_TRUE(std::filesystem::exists(folder_.path() / "out/imu.csv"));
  EXPECT_TRUE(std::filesystem::exists(folder_.path() / "out/states.csv"));
}

TEST_F(ImuSimulation, CalibrationsHoldEveryDistortion) {
  World world = build_world(scenario_, 1, kQuiet);
  Camera& model = world.info.cameras[0].model;
  for (const auto& as_text : {kalibr_camchain, rig_yaml}) {
    const auto read_back = [&](const Distortion& distortion) {
      model.distortion = distortion;
      return read_calibration(folder_.write("calibration.yaml", as_text(world.info)))[0].model.distortion;
    };
    EXPECT_TRUE(std::holds_alternative<NoDistortion>(read_back(NoDistortion{})));
    const auto radial = std::get<RadialTangential>(read_back(RadialTangential{-0.1, 0.01, 1e-3, 2e-3, 1.0 / 3000}));
    EXPECT_EQ(radial.p1, 1e-3);
    EXPECT_EQ(radial.k3, 1.0 / 3000);
    EXPECT_EQ(std::get<Equidistant>(read_back(Equidistant{-0.1, 0.01, 0.002, 0.1 / 3})).k4, 0.1 / 3);
    EXPECT_EQ(std::get<Fov>(read_back(Fov{0.93})).w, 0.93);
  }
}

TEST_F(ImuSimulation, RigFilesHoldTheCameras) {
  const World world = build_world(scenario_, 1, kQuiet);
  const auto cameras = read_calibration(folder_.write("rig.yaml", rig_yaml(world.info)));
  ASSERT_EQ(cameras.size(), world.info.cameras.size());
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    const CameraInfo& camera = world.info.cameras[i];
    EXPECT_EQ(cameras[i].name, camera.name);
    EXPECT_EQ(cameras[i].model.fx, camera.model.fx);
    EXPECT_EQ(cameras[i].model.cy, camera.model.cy);
    EXPECT_EQ(cameras[i].model.height, camera.model.height);
    EXPECT_LT((cameras[i].T_body_camera.matrix() - camera.T_body_camera.matrix()).cwiseAbs().maxCoeff(), 1e-12);
  }
}

TEST_F(ImuSimulation, WithoutAnImuTheFirstCameraIsTheReference) {
  scenario_.imu.reset();
  const std::unique_ptr<Sink> sink = build_sink(scenario_, folder_.path() / "out");
  World world = build_world(scenario_, 1, kQuiet);
  sink->begin(world.info);
  sink->end(true);
  const auto cameras = read_calibration(folder_.path() / "out/calibration/camchain.yaml");
  const auto relative = [](const SE3& a, const SE3& b) { return (a.inverse() * b).matrix(); };
  EXPECT_LT((relative(cameras[0].T_body_camera, cameras[1].T_body_camera) -
             relative(world.info.cameras[0].T_body_camera, world.info.cameras[1].T_body_camera))
                .cwiseAbs()
                .maxCoeff(),
            1e-12);
  EXPECT_FALSE(std::filesystem::exists(folder_.path() / "out/imu.csv"));
}

TEST_F(ImuSimulation, NamesThePoseThatIsNone) {
  scenario_.imu->T_body_imu.quaternion = Eigen::Vector4d::Zero();
  const auto message = [&] { return test::message_of<UserError>([&] { build_world(scenario_, 1, kQuiet); }); };
  EXPECT_TRUE(test::contains(message(), "imu.T_body_imu: quaternion must not be [0, 0, 0, 0]"));
  scenario_.imu.reset();
  scenario_.cameras[1].T_body_camera.quaternion = Eigen::Vector4d::Zero();
  EXPECT_TRUE(test::contains(message(), "camera right: T_body_camera: quaternion"));
}

}  // namespace
}  // namespace esim
