#include <fmt/format.h>

#include "commands.h"
#include "esim/compose/compose.h"
#include "esim/scenario/read.h"

namespace esim::app {
namespace {

int run(const std::string& file, const std::vector<std::string>& overrides) {
  const Scenario scenario = read_scenario(file, overrides);
  Notices notices;
  notices.warning = [](const std::string& text) { fmt::print(stderr, "warning: {}\n", text); };
  notices.note = [](const std::string& text) { fmt::print("{}\n", text); };
  const World world = build_world(scenario, 0, notices);
  for (std::size_t i = 0; i < world.cameras.size(); ++i) {
    const CameraInfo& camera = world.info.cameras[i];
    fmt::print("camera {}: {}x{} px, fx {:.2f}, fy {:.2f}, renderer {}, {} sampling\n", camera.name, camera.model.width,
               camera.model.height, camera.model.fx, camera.model.fy, world.cameras[i].renderer->traits().label(),
               std::visit([](const auto& sampling) { return sampling.kType; }, scenario.cameras[i].sampling));
    std::string names;
    for (const SensorOptions& sensor : scenario.cameras[i].event_cameras)
      names += (names.empty() ? "" : ", ") + sensor.name;
    if (!names.empty()) fmt::print("camera {}: event sensors {}\n", camera.name, names);
  }
  if (world.info.imu) fmt::print("imu: {} Hz\n", world.info.imu->rate_hz);
  fmt::print("duration: {:.3f} s\n{}: ready to simulate\n", to_seconds(world.info.end - world.info.start), file);
  return kOk;
}

}  // namespace

void add_check(CLI::App& app, int& exit_code) {
  struct CheckArguments {
    std::string scenario;
    std::vector<std::string> overrides;
  };
  auto arguments = std::make_shared<CheckArguments>();
  CLI::App* command =
      app.add_subcommand("check", "Check a scenario and the files that it names, without writing anything");
  command->add_option("scenario", arguments->scenario, "Scenario file (YAML)")->required()->type_name("SCENARIO.yaml");
  command->add_option("--set", arguments->overrides, "Change one option")
      ->type_name("KEY=VALUE")
      ->expected(1)
      ->take_all();
  command->footer("Example:\n  esim check scenes/room.yaml --set duration_s=1");
  command->callback([arguments, &exit_code] { exit_code = run(arguments->scenario, arguments->overrides); });
}

void add_options(CLI::App& app, int& exit_code) {
  CLI::App* command =
      app.add_subcommand("options", "Print every option of a scenario with default, unit, range and meaning");
  command->footer("Example:\n  esim options | grep contrast_threshold");
  command->callback([&exit_code] {
    fmt::print("{}", scenario_reference());
    exit_code = kOk;
  });
}

}  // namespace esim::app
