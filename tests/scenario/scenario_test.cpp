#include <gtest/gtest.h>

#include <fstream>

#include "esim/core/error.h"
#include "esim/geometry/calibration.h"
#include "esim/scenario/read.h"
#include "esim/scenario/suggest.h"
#include "support/errors.h"
#include "support/temporary_directory.h"
#include "support/test_data.h"

namespace esim {
namespace {

using test::contains;

constexpr const char* kMinimal = R"(
duration_s: 1
renderer: {type: panorama, image: p.jpg}
trajectory: {type: static}
)";

class ScenarioFile : public testing::Test {
 protected:
  Scenario read(const std::string& yaml, const std::vector<std::string>& overrides = {}) {
    std::ofstream(file()) << yaml;
    return read_scenario(file(), overrides);
  }
  std::string error(const std::string& yaml, const std::vector<std::string>& overrides = {}) {
    const std::string message = test::message_of<UserError>([&] { read(yaml, overrides); });
    EXPECT_EQ(message.find('\n'), std::string::npos) << "more than a line: " << message;
    return message;
  }
  std::filesystem::path file() const { return folder_.path() / "s.yaml"; }

  test::TemporaryDirectory folder_;
};

TEST_F(ScenarioFile, GivesDefaultsToWhatItDoesNotName) {
  const Scenario scenario = read(kMinimal);
  ASSERT_EQ(scenario.cameras.size(), 1U);
  EXPECT_EQ(scenario.cameras[0].name, "cam0");
  EXPECT_EQ(scenario.cameras[0].width, 346);
  EXPECT_DOUBLE_EQ(scenario.cameras[0].event_camera.threshold_on(), 0.5);
  EXPECT_DOUBLE_EQ(std::get<AdaptiveSampling>(scenario.cameras[0].sampling).tolerance, 0.25);
  EXPECT_EQ(std::get<PanoramaRendererOptions>(scenario.renderer).image, folder_.path() / "p.jpg")
      << "relative to the file";
  EXPECT_EQ(std::get<PanoramaRendererOptions>(scenario.renderer).median_px, 0);
  EXPECT_EQ(std::get<PanoramaRendererOptions>(scenario.renderer).gaussian_px, 0);
}

TEST_F(ScenarioFile, SoftensImagesOfPanoramasAndPlanes) {
  const auto with = [](const std::string& renderer) {
    return "duration_s: 1\ntrajectory: {type: static}\nrenderer: {image: p.jpg, " + renderer + "}\n";
  };
  const auto panorama =
      std::get<PanoramaRendererOptions>(read(with("type: panorama, median_px: 5, gaussian_px: 1.5")).renderer);
  EXPECT_EQ(panorama.median_px, 5);
  EXPECT_EQ(panorama.gaussian_px, 1.5);
  const auto plane = std::get<PlaneRendererOptions>(read(with("type: plane, median_px: 3, gaussian_px: 2")).renderer);
  EXPECT_EQ(plane.median_px, 3);
  EXPECT_EQ(plane.gaussian_px, 2);
  EXPECT_TRUE(contains(error(with("type: panorama, median_px: 257")), "renderer.median_px"));
  EXPECT_TRUE(contains(error(with("type: panorama, gaussian_px: -1")), "renderer.gaussian_px"));
}

TEST_F(ScenarioFile, SharesSamplingAndSensorAmongCameras) {
  const Scenario scenario = read(std::string(kMinimal) + R"(
sampling: {type: brightness, lambda: 0.3, min_rate_hz: 77}
event_camera: {contrast_threshold: 0.2, threshold_noise: 0.01}
cameras:
  - {width: 10, height: 20}
  - {name: right, sampling: {lambda: 0.1}, event_camera: {contrast_threshold_on: 0.4}}
  - {sampling: {type: uniform, rate_hz: 5}}
)");
  ASSERT_EQ(scenario.cameras.size(), 3U);
  EXPECT_EQ(scenario.cameras[1].name, "right");
  EXPECT_DOUBLE_EQ(std::get<BrightnessSampling>(scenario.cameras[0].sampling).lambda, 0.3);
  EXPECT_DOUBLE_EQ(std::get<BrightnessSampling>(scenario.cameras[1].sampling).lambda, 0.1);
  EXPECT_DOUBLE_EQ(std::get<BrightnessSampling>(scenario.cameras[1].sampling).bounds.min_rate_hz, 77);
  EXPECT_DOUBLE_EQ(std::get<UniformSampling>(scenario.cameras[2].sampling).rate_hz, 5);
  EXPECT_DOUBLE_EQ(scenario.cameras[1].event_camera.threshold_on(), 0.4);
  EXPECT_DOUBLE_EQ(scenario.cameras[1].event_camera.threshold_off(), 0.2);
  EXPECT_DOUBLE_EQ(scenario.cameras[1].event_camera.threshold_noise, 0.01);
}

TEST_F(ScenarioFile, GivesFramesToTheCamerasThatAskForThem) {
  EXPECT_FALSE(read(kMinimal).cameras[0].frame_camera);
  const std::string yaml = std::string(kMinimal) + R"(
frame_camera: {rate_hz: 20, response: {type: gamma, gamma: 1.8}, auto_exposure: {target: 0.3}}
cameras:
  - {width: 10}
  - {frame_camera: {exposure_s: 0.002, response: {type: measured, path: r.txt}, auto_exposure: null}}
  - {frame_camera: null}
)";
  const Scenario scenario = read(yaml);
  ASSERT_TRUE(scenario.cameras[0].frame_camera && scenario.cameras[1].frame_camera);
  EXPECT_FALSE(scenario.cameras[2].frame_camera);
  EXPECT_DOUBLE_EQ(scenario.cameras[0].frame_camera->rate_hz, 20);
  EXPECT_DOUBLE_EQ(scenario.cameras[0].frame_camera->exposure_s, 0.01);
  EXPECT_DOUBLE_EQ(scenario.cameras[0].frame_camera->auto_exposure.value().target, 0.3);
  EXPECT_DOUBLE_EQ(scenario.cameras[1].frame_camera->rate_hz, 20);
  EXPECT_DOUBLE_EQ(scenario.cameras[1].frame_camera->exposure_s, 0.002);
  EXPECT_FALSE(scenario.cameras[1].frame_camera->auto_exposure);
  EXPECT_EQ(std::get<MeasuredResponse>(scenario.cameras[1].frame_camera->response).path, folder_.path() / "r.txt");
  EXPECT_EQ(write_scenario(read(write_scenario(scenario))), write_scenario(scenario));
  EXPECT_TRUE(contains(error(std::string(kMinimal) + "frame_camera: 5\n"), "camera.frame_camera: must be a map"));
  EXPECT_TRUE(contains(error(std::string(kMinimal) + "sampling: adaptive\n"), "such as {type: adaptive}"));
  EXPECT_TRUE(contains(error(std::string(kMinimal) + "sampling: 5\n"), "such as {type: flow}"));
  EXPECT_TRUE(contains(error(std::string(kMinimal) + "event_camera: [1]\n"), "camera.event_camera: must be a map"));
}

TEST_F(ScenarioFile, NamesTheLineOrTheOptionOfACamerasValue) {
  const std::string yaml = std::string(kMinimal) + "camera:\n  width: 64\n  psf_px: -3\n";
  const auto line = std::to_string(std::count(yaml.begin(), yaml.end(), '\n'));
  EXPECT_TRUE(contains(error(yaml), ":" + line + ": camera.psf_px: -3 is out of range"));
  const std::string shared = std::string(kMinimal) + "event_camera:\n  leak_rate_hz: -1\ncamera: {width: 64}\n";
  const auto before_last = std::to_string(std::count(shared.begin(), shared.end(), '\n') - 1);
  EXPECT_TRUE(contains(error(shared), ":" + before_last + ": camera.event_camera.leak_rate_hz: -1"));
  EXPECT_TRUE(
      contains(error(kMinimal, {"event_camera.leak_rate_hz=no"}), "--set camera.event_camera.leak_rate_hz: must"));
  const std::string two = std::string(kMinimal) + "cameras: [{event_camera: {leak_rate_hz: 1}}, {}]\n";
  const Scenario scenario = read(two, {"event_camera.leak_rate_hz=2", "event_camera.hot_pixels=0.5"});
  EXPECT_EQ(scenario.cameras[0].event_camera.leak_rate_hz, 1) << "a camera's own value";
  EXPECT_EQ(scenario.cameras[0].event_camera.hot_pixels, 0.5);
  EXPECT_EQ(scenario.cameras[1].event_camera.leak_rate_hz, 2);
  EXPECT_TRUE(contains(error(std::string(kMinimal) + "camera: {width: 5, width: 6}\n"), "appears twice"));
}

TEST_F(ScenarioFile, ReadsTheFiltersOfTheSensor) {
  const std::string yaml = std::string(kMinimal) + R"(
event_camera: {preset: imx636, filters: {trail: {}, region: {windows: [{x: 3, y: 4, width: 5, height: 6}]}}}
cameras:
  - {width: 100, height: 80}
  - {event_camera: {filters: {anti_flicker: {low_hz: 90}, rate_controller: {}}}}
)";
  const Scenario scenario = read(yaml);
  const FilterOptions &first = scenario.cameras[0].event_camera.filters,
                      &second = scenario.cameras[1].event_camera.filters;
  ASSERT_TRUE(first.trail && first.region && !first.activity && !first.anti_flicker && !first.rate_controller);
  EXPECT_EQ(first.region->windows.at(0).width, 5);
  EXPECT_EQ(first.trail->threshold_us, TrailFilterOptions{}.threshold_us);
  ASSERT_TRUE(second.anti_flicker && second.rate_controller && !second.trail) << "a camera's own filters";
  EXPECT_EQ(second.anti_flicker->low_hz, 90);
  EXPECT_EQ(scenario.cameras[1].event_camera.preset, SensorPreset::find("imx636"));
  EXPECT_EQ(write_scenario(read(write_scenario(scenario))), write_scenario(scenario));
  EXPECT_FALSE(read(kMinimal).cameras[0].event_camera.filters.any());
  EXPECT_TRUE(read(kMinimal, {"event_camera.filters.trail={}"}).cameras[0].event_camera.filters.trail);
  EXPECT_FALSE(read(yaml, {"event_camera.filters.trail=null"}).cameras[0].event_camera.filters.trail);
}

TEST_F(ScenarioFile, RefusesFiltersThatContradictThemselves) {
  const auto with = [&](const std::string& filters, const std::string& camera = "{width: 64, height: 48}") {
    return error(std::string(kMinimal) + "camera: " + camera + "\nevent_camera:\n  filters:\n    " + filters + "\n");
  };
  EXPECT_EQ(with("anti_flicker: {low_hz: 300, high_hz: 200}"),
            file().string() +
                ":8: camera.event_camera.filters.anti_flicker.low_hz: must be below high_hz, 200 Hz; it "
                "is 300 Hz");
  EXPECT_TRUE(contains(with("anti_flicker: {high_hz: 20}"),  // the key of the message is not in the file
                       ":8: camera.event_camera.filters.anti_flicker.low_hz: must be below high_hz, 20 Hz"));
  EXPECT_TRUE(contains(with("activity: {}"), "event_camera.filters.activity: has no bound"));
  EXPECT_TRUE(contains(with("activity: {lower_start: 5, lower_stop: 6}"), "event_camera.filters.activity.lower_stop"));
  EXPECT_TRUE(contains(with("region: {windows: [{x: 1, y: 1}, {x: 64, y: 2}]}"),
                       "event_camera.filters.region.windows.1: (64, 2) lies outside the sensor of 64 x 48 px"));
  EXPECT_TRUE(
      contains(with("region: {masked_pixels: [{x: 3, y: 48}]}"), "filters.region.masked_pixels.0: (3, 48) lies"));
  EXPECT_TRUE(contains(with("trail: {threshold_us: 0}"), "event_camera.filters.trail.threshold_us: 0 is out of range"));
  EXPECT_TRUE(contains(with("trails: {}"), "trail"));
  EXPECT_TRUE(contains(with("trail: 5"), "event_camera.filters.trail: must be a map"));
  EXPECT_TRUE(contains(error(std::string(kMinimal) + "cameras: [{}, {event_camera: {filters: {activity: {}}}}]\n"),
                       "cameras.1.event_camera.filters.activity: has no bound"));
  EXPECT_TRUE(contains(error(kMinimal, {"camera.event_camera.filters.region.masked_pixels=[{x: 400, y: 3}]"}),
                       "--set camera.event_camera.filters.region.masked_pixels.0: (400, 3) lies outside"));
}

TEST_F(ScenarioFile, IsTheSameAfterWritingAndReading) {
  const Scenario scenario = read(std::string(kMinimal) + R"(
seed: 18446744073709551615
start_s: 0.1
truth: {rate_hz: 12.5, depth: false}
output: {time_unit: ns, compression: gzip}
cameras:
  - {fx: 200.123456789012345, cy: 3, distortion: {type: radial-tangential, k1: -0.38, p2: 1e-3}}
  - {name: b, T_body_camera: {position: [0.1, 0, 0], quaternion: [0, 0.6, 0, 0.8]}, sampling: {type: uniform}}
)");
  const std::string text = write_scenario(scenario);
  EXPECT_EQ(write_scenario(read(text)), text);
  EXPECT_TRUE(contains(text, "200.1234567890123"));
  EXPECT_EQ(read(text).seed, 18446744073709551615U);
  EXPECT_EQ(read(text).output.time_unit, EventTimeUnit::ns);
}

TEST_F(ScenarioFile, ReadsListsOfObjectsAndLights) {
  const std::string yaml = R"(
duration_s: 1
trajectory: {type: static}
renderer:
  type: mesh
  scene: room.obj
  objects:
    - {scene: ball.obj, scale: 0.5, trajectory: {type: file, path: ball.csv, time_scale: 2}}
    - {name: fan, scene: fan.obj, trajectory: {type: random, rotation_amplitude_deg: [0, 0, 90]}}
  lighting: {type: lambert, ambient: 0.1, suns: [{direction: [1, 0, -1]}], points: [{position: [0, 0, 2], strength: 9}]}
)";
  const auto renderer = std::get<MeshRendererOptions>(read(yaml).renderer);
  ASSERT_EQ(renderer.objects.size(), 2U);
  EXPECT_EQ(renderer.objects[0].scene, folder_.path() / "ball.obj") << "relative to the file";
  EXPECT_EQ(std::get<FileTrajectoryOptions>(renderer.objects[0].trajectory).path, folder_.path() / "ball.csv");
  EXPECT_DOUBLE_EQ(std::get<FileTrajectoryOptions>(renderer.objects[0].trajectory).time_scale, 2);
  EXPECT_TRUE(std::holds_alternative<RandomTrajectoryOptions>(renderer.objects[1].trajectory));
  const auto& lambert = std::get<LambertOptions>(renderer.lighting);
  EXPECT_DOUBLE_EQ(lambert.suns.at(0).direction.x(), 1);
  EXPECT_DOUBLE_EQ(lambert.points.at(0).strength, 9);
  EXPECT_EQ(write_scenario(read(write_scenario(read(yaml)))), write_scenario(read(yaml)));

  const auto scaled = read(yaml, {"renderer.objects.1.scale=3"});
  EXPECT_DOUBLE_EQ(std::get<MeshRendererOptions>(scaled.renderer).objects[1].scale, 3);
  EXPECT_TRUE(contains(error(yaml, {"renderer.objects.0.scale=0"}), "renderer.objects.0.scale"));
  EXPECT_TRUE(contains(error(yaml, {"renderer.objects=3"}), "must be a list"));
  EXPECT_TRUE(contains(error(yaml, {"renderer.lighting.type=phong"}), "is not one of unlit, lambert, pbr"));
}

TEST_F(ScenarioFile, ReadsTheWaypointsOfObjectsInEveryRenderer) {
  std::ofstream(folder_.path() / "walk.yaml") << "points: [{position: [0, 0, 1]}, {position: [2, 0, 1]}]\n";
  for (const std::string renderer : {"mesh, scene: room.obj", "unrealcv", "blender, scene: room.blend"}) {
    const Scenario scenario = read("trajectory: {type: static}\nrenderer: {type: " + renderer +
                                   ", objects: [{name: a, trajectory: {type: waypoints, file: walk.yaml}}]}\n");
    std::visit(
        [&](const auto& options) {
          if constexpr (requires { options.objects; }) {
            ASSERT_EQ(options.objects.size(), 1U) << renderer;
            const auto& path = std::get<WaypointTrajectoryOptions>(options.objects[0].trajectory);
            EXPECT_EQ(path.points.size(), 2U) << renderer;
            EXPECT_EQ(path.points_file, folder_.path() / "walk.yaml") << renderer;
          } else {
            ADD_FAILURE() << renderer;
          }
        },
        scenario.renderer);
  }
}

TEST_F(ScenarioFile, SamplesCompleteImagesByDefaultIfAGraphicsCardMayRender) {
  const std::string rest = ", scene: s.ply}\ntrajectory: {type: static}\nduration_s: 1\n";
  const auto renders_images = [&](const std::string& renderer) {
    const Scenario scenario = read("renderer: {type: " + renderer + rest);
    return std::holds_alternative<FlowSampling>(scenario.cameras[0].sampling);
  };
  for (const std::string type : {"mesh", "splats"}) {
    EXPECT_FALSE(renders_images(type)) << type;
    EXPECT_FALSE(renders_images(type + ", engine: processor")) << type;
    EXPECT_TRUE(renders_images(type + ", engine: gl")) << type;
    EXPECT_TRUE(renders_images(type + ", engine: auto")) << type;
  }
}

TEST_F(ScenarioFile, TakesOverrides) {
  const Scenario scenario =
      read(kMinimal, {"event_camera.contrast_threshold=0.2", "sampling.type=flow", "sampling.lambda=0.25",
                      "truth.images=false", "trajectory.pose.position=[1, 2, 3]", "seed=9"});
  EXPECT_DOUBLE_EQ(scenario.cameras[0].event_camera.contrast_threshold, 0.2);
  EXPECT_DOUBLE_EQ(std::get<FlowSampling>(scenario.cameras[0].sampling).lambda, 0.25);
  EXPECT_FALSE(scenario.truth.images);
  EXPECT_DOUBLE_EQ(std::get<StaticTrajectoryOptions>(scenario.trajectory).pose.position.z(), 3);
  EXPECT_EQ(scenario.seed, 9U);
  EXPECT_EQ(read(std::string(kMinimal) + "cameras: [{width: 5}, {width: 6}]", {"cameras.1.width=7"}).cameras[1].width,
            7);
}

TEST_F(ScenarioFile, RefusesUnknownKeysAndNamesTheNearest) {
  EXPECT_TRUE(
      contains(error(std::string(kMinimal) + "event_camera: {contrast_treshold: 0.2}\n"), "contrast_threshold?"));
  EXPECT_TRUE(contains(error(std::string(kMinimal) + "event_camera: {contrast_treshold: 0.2}\n"), "s.yaml"));
  EXPECT_TRUE(
      contains(error(std::string(kMinimal) + "samplin: {}\n"), ":5: samplin: unknown key; did you mean sampling?"));
  EXPECT_TRUE(contains(error(kMinimal, {"truth.rate=3"}), "--set truth.rate: unknown key; did you mean rate_hz?"));
  EXPECT_TRUE(contains(error(std::string(kMinimal) + "xyzzy: 1\n"), "valid keys are"));
}

TEST_F(ScenarioFile, RefusesWrongTypesAndRanges) {
  const std::pair<const char*, const char*> cases[] = {
      {"truth: {rate_hz: fast}", "must be a number, not 'fast'"},
      {"truth: {rate_hz: -1}", "out of range: must be at least 0 Hz"},
      {"truth: {rate_hz: .nan}", "must be a number"},
      {"truth: {images: maybe}", "must be true or false"},
      {"truth: 3", "must be a map"},
      {"camera: {width: 0}", "out of range: must be at least 1 px"},
      {"camera: {width: 1.5}", "must be a whole number"},
      {"camera: {T_body_camera: {position: [1, 2]}}", "must be a list of 3 numbers"},
      {"sampling: {type: flow, lambda: 0}", "must be above 0"},
      {"sampling: {type: flow, lambda: .inf}", "must be a number"},
      {"sampling: {type: flo}", "did you mean flow?"},
      {"sampling: {lambda: 0.5}", "needs a type: one of flow, brightness, uniform"},
      {"output: {time_unit: ms}", "is not one of us, ns"},
      {"seed: -3", "whole number from 0"},
      {"cameras: []", "at least one camera"},
      {"cameras: [{name: a}, {name: a}]", "two cameras are named a"},
      {"cameras: [{name: ../x}]", "must consist of letters"},
      {"camera: {width: 3, width: 4}", "appears twice"},
  };
  for (const auto& [yaml, expected] : cases) {
    EXPECT_TRUE(contains(error(std::string(kMinimal) + yaml + "\n"), expected)) << yaml;
  }
}

TEST_F(ScenarioFile, RefusesFilesThatAreNoScenario) {
  EXPECT_TRUE(contains(error("renderer: [1, 2"), "not valid YAML"));
  EXPECT_TRUE(contains(error("just text"), "a scenario must be a map"));
  EXPECT_TRUE(contains(error("duration_s: 1\ntrajectory: {type: static}\n"), "renderer: is missing"));
  EXPECT_TRUE(contains(test::message_of<UserError>([&] { read_scenario(folder_.path() / "none.yaml"); }),
                       "no such scenario file"));
  EXPECT_TRUE(contains(error("renderer: {type: panorama, image: '${ESIM_NO_SUCH}/x'}\n"),
                       "environment variable ESIM_NO_SUCH is not set"));
}

TEST_F(ScenarioFile, MayBeTextThatAProgramHasPutTogether) {
  ScenarioText text;
  text.yaml = kMinimal;
  text.file = folder_.path() / "nowhere.yaml";
  text.overrides = {"seed=4"};
  const Scenario scenario = read_scenario(text);
  EXPECT_EQ(scenario.seed, 4U);
  EXPECT_EQ(std::get<PanoramaRendererOptions>(scenario.renderer).image, folder_.path() / "p.jpg");

  const auto refusal = [&] { return test::message_of<UserError>([&] { read_scenario(text); }); };
  text.setter = "";
  text.overrides = {"seed=-4"};
  EXPECT_TRUE(refusal().starts_with("seed: "));
  text.overrides.clear();
  text.yaml = "duration_s: -1\ntrajectory: {type: static}";
  EXPECT_TRUE(contains(refusal(), "nowhere.yaml:1: duration_s"));
  text.has_lines = false;
  EXPECT_TRUE(contains(refusal(), "nowhere.yaml: duration_s"));

  text.yaml = "duration_s: 1";
  EXPECT_TRUE(contains(refusal(), "renderer: is missing"));
  text.needs_renderer = false;
  EXPECT_TRUE(contains(refusal(), "trajectory: is missing"));
  text.needs_trajectory = false;
  EXPECT_EQ(read_scenario(text).duration_s, 1);
}

TEST_F(ScenarioFile, RefusesOverridesThatAreNone) {
  EXPECT_TRUE(contains(error(kMinimal, {"seed"}), "expected key=value"));
  EXPECT_TRUE(contains(error(kMinimal, {"seed.x=1"}), "--set"));
}

TEST_F(ScenarioFile, RefusesGeometryBesideACalibration) {
  std::ofstream(folder_.path() / "c.yaml") << "cam0: {}\n";
  EXPECT_TRUE(contains(error(std::string(kMinimal) + "camera: {calibration: c.yaml, fx: 3}\n"),
                       "camera.fx: must not be given together with a calibration file"));
}

TEST(Calibration, ReadsTheOriginalsRigs) {
  const auto ijrr = test::test_data("calibration/ijrr.yaml");
  if (!ijrr) GTEST_SKIP() << "needs ESIM_TEST_DATA";
  const auto cameras = read_calibration(*ijrr);
  ASSERT_EQ(cameras.size(), 1U);
  EXPECT_EQ(cameras[0].name, "dvs");
  EXPECT_EQ(cameras[0].model.width, 240);
  EXPECT_NEAR(cameras[0].model.fy, 199.7078674353677, 1e-12);
  EXPECT_NEAR(std::get<RadialTangential>(cameras[0].model.distortion).k2, 0.18933636521343228, 1e-15);
  EXPECT_NEAR(cameras[0].T_body_camera.translation.z(), 0.0342573613538, 1e-12);
  for (const char* name :
       {"pinhole_mono.yaml", "pinhole_mono_nodistort.yaml", "pinhole_wide_fov.yaml", "quadrotor.yaml"}) {
    EXPECT_EQ(read_calibration(ijrr->parent_path() / name).size(), 1U) << name;
  }
}

constexpr const char* kCamchain = R"(
cam0:
  camera_model: pinhole
  distortion_model: equidistant
  distortion_coeffs: [-0.1, 0.01, 0.0, 0.0]
  intrinsics: [235.9, 235.8, 170.4, 130.1]
  resolution: [346, 260]
  T_cam_imu: [[0, 1, 0, 0.1], [0, 0, 1, 0.2], [1, 0, 0, 0.3], [0, 0, 0, 1]]
cam1:
  camera_model: pinhole
  distortion_model: radtan
  distortion_coeffs: [-0.3, 0.1, 0.001, 0.002]
  intrinsics: [230, 231, 170, 130]
  resolution: [346, 260]
  T_cn_cnm1: [[1, 0, 0, -0.11], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
)";

TEST(Calibration, ReadsKalibrsCamchain) {
  const test::TemporaryDirectory folder;
  std::ofstream(folder.path() / "chain.yaml") << kCamchain;
  const auto cameras = read_calibration(folder.path() / "chain.yaml");
  ASSERT_EQ(cameras.size(), 2U);
  EXPECT_DOUBLE_EQ(std::get<Equidistant>(cameras[0].model.distortion).k1, -0.1);
  // T_cam_imu maps the body's origin to (0.1, 0.2, 0.3) in cam0; cam1 sits 0.11 m to the right of cam0.
  EXPECT_LT((cameras[0].T_body_camera * Eigen::Vector3d(0.1, 0.2, 0.3)).norm(), 1e-12);
  const Eigen::Vector3d baseline = cameras[0].T_body_camera.inverse() * cameras[1].T_body_camera.translation;
  EXPECT_LT((baseline - Eigen::Vector3d(0.11, 0, 0)).norm(), 1e-12);
}

TEST(Calibration, RefusesWhatItCannotHold) {
  const test::TemporaryDirectory folder;
  const auto message = [&](std::string from, const std::string& to) {
    std::string text = kCamchain;
    text.replace(text.find(from), from.size(), to);
    std::ofstream(folder.path() / "chain.yaml") << text;
    return test::message_of<UserError>([&] { read_calibration(folder.path() / "chain.yaml"); });
  };
  EXPECT_TRUE(
      contains(message("camera_model: pinhole", "camera_model: omni"), "cam0: camera model 'omni' is not supported"));
  EXPECT_TRUE(contains(message("[235.9, 235.8, 170.4, 130.1]", "[235.9, 235.8, 170.4]"),
                       "intrinsics must have 4 numbers, not 3"));
  EXPECT_TRUE(contains(message("235.9", "-235.9"), "cam0"));
  EXPECT_TRUE(contains(message("equidistant", "equisolid"), "'equisolid' is not supported"));
  EXPECT_TRUE(contains(message("[0, 1, 0, 0.1]", "[0, 2, 0, 0.1]"), "T_cam_imu"));
  EXPECT_TRUE(contains(message("resolution: [346, 260]", "x: 1"), "resolution is missing"));
  EXPECT_TRUE(contains(message("cam0:", "camera0:"), "contains no cameras"));
  EXPECT_TRUE(contains(test::message_of<UserError>([] { read_calibration("/no/such.yaml"); }), "no such file"));
}

TEST(Calibration, RefusesHostileNumbersNamingTheCameraAndTheKey) {
  const test::TemporaryDirectory folder;
  const auto message = [&](std::string from, const std::string& to) {
    std::string text = kCamchain;
    text.replace(text.find(from), from.size(), to);
    std::ofstream(folder.path() / "chain.yaml") << text;
    return test::message_of<UserError>([&] { read_calibration(folder.path() / "chain.yaml"); });
  };
  const auto names = [](const std::string& text, const std::string& camera, const std::string& key) {
    return text.find("chain.yaml: " + camera + ": ") != std::string::npos && text.find(key) != std::string::npos;
  };
  EXPECT_PRED3(names, message("235.9", "-235.9"), "cam0", "fx is -235.9 px; it must be positive");
  EXPECT_PRED3(names, message("130.1", ".inf"), "cam0", "cy");
  EXPECT_PRED3(names, message("231", ".nan"), "cam1", "fy");
  EXPECT_PRED3(names, message("-0.3, 0.1", ".nan, 0.1"), "cam1", "k1");
  EXPECT_PRED3(names, message("-0.3, 0.1, 0.001, 0.002", "-0.3, 0.1"), "cam1", "distortion_coeffs must have 4 numbers");
  EXPECT_PRED3(names, message("distortion_coeffs: [-0.1, 0.01, 0.0, 0.0]", "x: 1"), "cam0", "distortion_coeffs");
  for (const char* size : {"[-346, 260]", "[346.5, 260]", "[1e9, 260]", "[.nan, 260]", "[0, 260]"})
    EXPECT_PRED3(names, message("[346, 260]", size), "cam0", "the image size");
  EXPECT_PRED3(names, message("[1, 0, 0, -0.11]", "[-1, 0, 0, -0.11]"), "cam1", "T_cn_cnm1: pose matrix");
  EXPECT_PRED3(names, message("[1, 0, 0, -0.11]", "[.nan, 0, 0, -0.11]"), "cam1", "T_cn_cnm1: pose matrix");
  EXPECT_PRED3(names, message("[0, 1, 0, 0.1]", "[0, 1, 0, .inf]"), "cam0", "T_cam_imu: pose matrix");
  EXPECT_PRED3(names, message("  T_cam_imu", "  timeshift_cam_imu: -8.1e-05\n  T_cam_imu"), "cam0",
               "timeshift_cam_imu is -8.1e-05 s, but all simulated sensors share one clock; set it to 0");
  EXPECT_EQ(message("  T_cam_imu", "  timeshift_cam_imu: 0.0\n  T_cam_imu"), "nothing was thrown");
}

constexpr const char* kImuYaml = R"(
accelerometer_noise_density: 0.006
accelerometer_random_walk: 0.0002
gyroscope_noise_density: 0.0004
gyroscope_random_walk: 4.0e-06
rostopic: /imu0
update_rate: 200.0
)";

TEST(Calibration, ReadsKalibrsImu) {
  const test::TemporaryDirectory folder;
  std::string nested = "imu0:\n  T_i_b: [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]\n";
  nested += "  model: calibrated\n  time_offset: 0.0\n";
  std::istringstream lines(kImuYaml);
  for (std::string line; std::getline(lines, line);) nested += "  " + line + "\n";
  for (const std::string& text : {std::string(kImuYaml), nested}) {
    const CalibratedImu imu = read_imu_calibration(folder.write("imu.yaml", text));
    EXPECT_EQ(imu.rate_hz, 200);
    EXPECT_EQ(imu.gyroscope_noise_density, 0.0004);
    EXPECT_EQ(imu.gyroscope_random_walk, 4e-6);
    EXPECT_EQ(imu.accelerometer_noise_density, 0.006);
    EXPECT_EQ(imu.accelerometer_random_walk, 0.0002);
  }
  const auto message = [&](const std::string& text) {
    return test::message_of<UserError>([&] { read_imu_calibration(folder.write("imu.yaml", text)); });
  };
  const std::string yaml = kImuYaml;
  EXPECT_TRUE(contains(message(""), "imu.yaml: is not an imu.yaml"));
  EXPECT_TRUE(contains(message("update_rate: 200\n"), "imu.yaml: imu0: gyroscope_noise_density is missing"));
  EXPECT_TRUE(contains(message(yaml + "time_offset: 0.01\n"), "imu0: time_offset is 0.01 s"));
  EXPECT_TRUE(contains(message(yaml + "model: scale-misalignment\n"), "'scale-misalignment' is not supported"));
  EXPECT_TRUE(contains(message(yaml + "imu1: {}\n"), "imu1 is also defined"));
  EXPECT_TRUE(contains(message(yaml + "T_i_b: [1, 0, 0, 0]\n"), "T_i_b must have 16 numbers, not 4"));
  const auto changed = [&](const std::string& from, const std::string& to) {
    std::string text = yaml;
    text.replace(text.find(from), from.size(), to);
    return message(text);
  };
  EXPECT_TRUE(contains(changed("0.0004", "-0.0004"), "gyroscope_noise_density is -0.0004; it must be from 0"));
  EXPECT_TRUE(contains(changed("0.006", ".nan"), "accelerometer_noise_density is nan"));
  EXPECT_TRUE(contains(changed("200.0", "2e9"), "update_rate is 2000000000; it must be from 0 to 1000000000"));
  EXPECT_TRUE(contains(changed("200.0", "0"), "update_rate is 0 Hz; it must be positive"));
  EXPECT_TRUE(contains(changed("200.0", "fast"), "update_rate has the wrong type"));
}

TEST_F(ScenarioFile, DescribesAnImuWhereThereIsOne) {
  EXPECT_FALSE(read(kMinimal).imu);
  EXPECT_TRUE(read(std::string(kMinimal) + "imu: {}\n").imu);
  folder_.write("imu.yaml", kImuYaml);
  const std::string yaml = std::string(kMinimal) +
                           "imu: {calibration: imu.yaml, T_body_imu: {position: [0.1, 0, 0]}, "
                           "gyroscope: {misalignment: [0, 0, 0.01, 0, 0, 0], range: 8.7}}\n";
  const Scenario scenario = read(yaml);
  EXPECT_EQ(scenario.imu->rate_hz, 200);
  EXPECT_EQ(scenario.imu->accelerometer.noise_density, 0.006);
  EXPECT_EQ(scenario.imu->gyroscope.misalignment[2], 0.01);
  EXPECT_EQ(scenario.imu->gyroscope.range, 8.7);
  EXPECT_EQ(scenario.imu->T_body_imu.position.x(), 0.1);
  EXPECT_EQ(write_scenario(read(write_scenario(scenario))), write_scenario(scenario));
  EXPECT_EQ(read(write_scenario(scenario)).imu->gyroscope.random_walk, 4e-6);

  EXPECT_TRUE(contains(error(yaml, {"imu.rate_hz=100"}), "imu.rate_hz: must not be given together"));
  EXPECT_TRUE(contains(error(yaml, {"imu.gyroscope.noise_density=0"}), "imu.gyroscope.noise_density: must not"));
  const auto imu = [&](const std::string& text) { return error(std::string(kMinimal) + "imu: {" + text + "}\n"); };
  EXPECT_TRUE(contains(imu("rate_hz: 1.1e9"), "imu.rate_hz: 1.1e9 is out of range"));
  EXPECT_TRUE(contains(imu("accelerometer: {random_walk: -1}"), "imu.accelerometer.random_walk: -1 is out of range"));
  EXPECT_TRUE(contains(imu("gyroscope: {misalignment: [1]}"), "must be a list of 6 numbers"));
  EXPECT_TRUE(contains(imu("acelerometer: {}"), "did you mean accelerometer?"));
}

TEST(Suggest, FindsTheNearestWord) {
  EXPECT_EQ(nearest("lamda", {"lambda", "rate_hz"}), "lambda");
  EXPECT_EQ(nearest("rate", {"lambda", "pose_rate_hz", "rate_hz"}), "rate_hz");
  EXPECT_EQ(nearest("qqqqqq", {"lambda", "rate_hz"}), "");
}

TEST_F(ScenarioFile, APresetStandsForWhatIsNotGiven) {
  const EventCameraOptions davis = preset_options("davis346@1");
  const EventCameraOptions given =
      read(std::string(kMinimal) + "event_camera: {contrast_threshold: 0.25, preset: davis346@1}\n")
          .cameras[0]
          .event_camera;
  EXPECT_EQ(given.preset.name(), "davis346@1");
  EXPECT_EQ(given.threshold_on(), 0.25);
  EXPECT_EQ(given.threshold_off(), 0.25);
  EXPECT_EQ(given.low_pass_hz, davis.low_pass_hz);
  EXPECT_EQ(given.readout.rate_mev_per_s, davis.readout.rate_mev_per_s);
  EXPECT_GT(davis.leak_rate_hz, 0);

  const EventCameraOptions set =
      read(kMinimal, {"event_camera.preset=gen3.1-vga", "event_camera.readout.queue_events=7"}).cameras[0].event_camera;
  EXPECT_EQ(set.preset.name(), "gen3.1-vga@2");
  EXPECT_EQ(set.readout.queue_events, 7);
  EXPECT_TRUE(contains(error(std::string(kMinimal) + "event_camera: {preset: davis364}\n"), "davis346"));
}

TEST_F(ScenarioFile, PresetsAreWithinTheRangesOfTheirOptions) {
  EXPECT_EQ(SensorPreset::names().size(), 3 + 6 * 3 + 2U);
  for (const std::string& name : SensorPreset::names()) {
    const Scenario scenario = read(kMinimal, {"event_camera.preset=" + name});
    EXPECT_EQ(write_scenario(read(write_scenario(scenario))), write_scenario(scenario)) << name;
    EXPECT_NO_THROW(check(scenario.cameras[0].event_camera)) << name;
  }
}

TEST_F(ScenarioFile, APresetHasVersions) {
  const auto preset = [&](const std::string& name) {
    return read(kMinimal, {"event_camera.preset=" + name}).cameras[0].event_camera;
  };
  for (const char* sensor : {"dvs128", "davis240c", "davis346", "dvxplorer", "gen3.1-vga", "imx636"}) {
    const std::string name = sensor;
    EXPECT_EQ(preset(name).preset.name(), name + "@2");
    EXPECT_TRUE(preset(name + "@2").circuit) << name;
    EXPECT_EQ(preset(name + "@1").preset.name(), name + "@1");
    EXPECT_FALSE(preset(name + "@1").circuit) << name;
    EXPECT_GT(preset(name + "@1").shot_noise_hz, 0) << name;
  }
  EXPECT_EQ(preset("genx320").preset.name(), "genx320@2");
  for (const char* name : {"ideal", "v2e-clean", "v2e-noisy"}) EXPECT_EQ(preset(name).preset.name(), name);
  EXPECT_TRUE(contains(write_scenario(read(kMinimal, {"event_camera.preset=davis346"})), "preset: davis346@2"));

  const auto problem = [&](const std::string& name) { return error(kMinimal, {"event_camera.preset=" + name}); };
  EXPECT_TRUE(contains(problem("davis346@3"),
                       "event_camera.preset: 'davis346@3' does not exist; davis346 has the "
                       "versions 1 and 2"));
  EXPECT_TRUE(contains(problem("genx320@1"), "genx320 has the version 2"));
  EXPECT_TRUE(contains(problem("ideal@1"), "ideal has no versions"));
  EXPECT_TRUE(contains(problem("davis346@"), "davis346 has the versions 1 and 2"));
  EXPECT_TRUE(contains(problem("davis364@2"), "did you mean davis346@2?"));
  EXPECT_TRUE(contains(problem("gen3.1vga"), "did you mean gen3.1-vga?"));
  EXPECT_TRUE(contains(problem("[1]"), "event_camera.preset"));
  EXPECT_TRUE(contains(test::message_of<UserError>([] { preset_options("davis346@3"); }), "versions 1 and 2"));
  EXPECT_TRUE(contains(test::message_of<UserError>([] { preset_options("davis"); }), "there is no 'davis'"));
}

TEST_F(ScenarioFile, TheLightAppliesToEveryEventCamera) {
  const Scenario scenario = read(std::string(kMinimal) +
                                 "light: {white_lux: 20}\nevent_camera: {preset: davis346}\ncameras:\n- {}\n"
                                 "- event_camera: {circuit: {white_lux: 3}}\n- event_camera: {preset: davis346@1}\n");
  const auto in_light = [&](std::size_t i) { return in_light_of(scenario, scenario.cameras[i].event_camera); };
  EXPECT_EQ(in_light(0).circuit->white_lux, 20);
  EXPECT_EQ(in_light(1).circuit->white_lux, 3);
  EXPECT_FALSE(in_light(2).circuit);
  EXPECT_FALSE(scenario.cameras[0].event_camera.circuit->white_lux);
  // The recorded scenario keeps the light in one place, so that it can still be changed there.
  const Scenario again = read(write_scenario(scenario), {"light.white_lux=5"});
  EXPECT_EQ(in_light_of(again, again.cameras[0].event_camera).circuit->white_lux, 5);
  const Scenario dark = read(kMinimal, {"event_camera.preset=davis346"});
  EXPECT_DOUBLE_EQ(in_light_of(dark, dark.cameras[0].event_camera).circuit->white_photocurrent_fa(),
                   33 * 1000 * 0.9 / 16);

  for (const char* value : {"0", "-1", "1e10", ".nan", ".inf"}) {
    EXPECT_TRUE(contains(error(kMinimal, {std::string("light.white_lux=") + value}), "light.white_lux: ")) << value;
  }
  for (const char* bad :
       {"white_lux: -2", "white_lux: 0", "f_number: 0", "transmission: 0", "transmission: 1.5",
        "photocurrent_fa_per_lux: 0", "dark_current_fa: 0", "photodiode_charge_e: 0", "source_follower_hz: 0",
        "source_follower_hz: .inf", "noise: -1", "noise: .nan", "max_rate_hz: -1"}) {
    const std::string key = std::string(bad).substr(0, std::string(bad).find(':'));
    const std::string message = error(kMinimal, {"event_camera.circuit={" + std::string(bad) + "}"});
    EXPECT_TRUE(contains(message, "event_camera.circuit." + key)) << message;
    EXPECT_FALSE(contains(message, "\n")) << message;
  }
}

}  // namespace
}  // namespace esim
