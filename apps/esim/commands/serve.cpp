#include "esim/live/serve.h"

#include <fmt/format.h>

#include <charconv>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <optional>
#include <system_error>
#include <thread>

#include "commands.h"
#include "esim/core/error.h"
#include "esim/scenario/read.h"
#include "support.h"

namespace esim::app {
namespace {

struct ServeArguments : esim::ServeOptions {
  std::string scenario;
  std::vector<std::string> overrides;
  bool quiet = false;
  bool to_ros2 = false, ros2_network = false;
  std::optional<int> ros_domain;
};

/// The domain that other nodes use by default.
int usual_domain() {
  const char* const text = std::getenv("ROS_DOMAIN_ID");
  if (text == nullptr || *text == '\0') return 0;
  int domain = 0;
  const auto [end, failure] = std::from_chars(text, text + std::strlen(text), domain);
  if (failure != std::errc{} || *end != '\0')
    throw UserError(fmt::format("ROS_DOMAIN_ID: must be a number, not {}", text));
  return domain;
}

/// Stops a server when a signal comes. SIGINT, SIGTERM and SIGHUP are blocked in all threads while it exists.
class StopOnSignal {
 public:
  explicit StopOnSignal(Server& server) {
    thread_ = std::thread([this, &server] {
      int signal = 0;
      sigwait(&signals(), &signal);
      server.stop();
    });
  }
  ~StopOnSignal() {
    pthread_kill(thread_.native_handle(), SIGTERM);  // if none came
    thread_.join();
  }
  StopOnSignal(const StopOnSignal&) = delete;
  StopOnSignal& operator=(const StopOnSignal&) = delete;

  /// Before any thread is started.
  static void block() { pthread_sigmask(SIG_BLOCK, &signals(), nullptr); }

 private:
  static const sigset_t& signals() {
    static const sigset_t set = [] {
      sigset_t made;
      sigemptyset(&made);
      sigaddset(&made, SIGINT);
      sigaddset(&made, SIGTERM);
      if (!is_ignored(SIGHUP)) sigaddset(&made, SIGHUP);
      return made;
    }();
    return set;
  }

  std::thread thread_;
};

int run(ServeArguments& arguments) {
  if (arguments.to_ros2 || arguments.ros2_network || arguments.ros_domain)
    arguments.ros2 = {arguments.ros_domain ? *arguments.ros_domain : usual_domain(), arguments.ros2_network};
  const Scenario scenario = read_scenario(std::filesystem::path(arguments.scenario), arguments.overrides);
  StopOnSignal::block();
  Server server(scenario, arguments);
  fmt::print("ws://{}:{}\n", arguments.place.host, server.port());
  std::fflush(stdout);
  tell(stderr, "open this address in Foxglove, Lichtblick or PlotJuggler (Foxglove WebSocket); Ctrl-C ends it\n");
  const StopOnSignal stop(server);
  server.run(printing(arguments.quiet));
  return kOk;
}

}  // namespace

void add_serve(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<ServeArguments>();
  CLI::App* command = app.add_subcommand("serve", "Simulate in real time and publish to viewers and programs");
  command->add_option("scenario", arguments->scenario, "Scenario file (YAML)")->type_name("SCENARIO.yaml")->required();
  command->add_option("--set", arguments->overrides, "Change one option, for example --set duration_s=60")
      ->type_name("KEY=VALUE")
      ->expected(1)
      ->take_all();
  command->add_option("--speed", arguments->speed, "Simulated seconds per second; 0: as fast as possible")
      ->capture_default_str()
      ->type_name("FACTOR");
  command->add_flag("--loop", arguments->loop, "Begin again at the end");
  command->add_flag("--paused", arguments->paused, "Wait for a client before the first sample");
  command->add_flag("--live-pose", arguments->live_pose,
                    "Clients move the camera: geometry_msgs/PoseStamped on /esim/pose, or TwistStamped on /esim/twist");
  command
      ->add_option("--pose-interval", arguments->pose_interval_s,
                   "Time between two poses with --live-pose; the motion is known one interval later")
      ->capture_default_str()
      ->type_name("S");
  command->add_option("--max-jump", arguments->max_jump_m, "Refuse poses that are farther from the camera")
      ->capture_default_str()
      ->type_name("M");
  command->add_option("--port", arguments->place.port, "Port to listen on")
      ->capture_default_str()
      ->type_name("N")
      ->check(CLI::Range(0, 65535));
  command
      ->add_option("--host", arguments->place.host,
                   "Address to listen on; 0.0.0.0 lets everyone in the network see and control the simulation")
      ->capture_default_str()
      ->type_name("ADDRESS");
  command->add_flag("--ros2", arguments->to_ros2,
                    "Also publish to ROS 2, for nodes on this machine (with ROS_LOCALHOST_ONLY=1)");
  command->add_flag("--ros2-network", arguments->ros2_network, "Also publish to ROS 2, for nodes in the network");
  command->add_option("--ros-domain", arguments->ros_domain, "Domain of ROS 2 (default: ROS_DOMAIN_ID, or 0)")
      ->type_name("N");
  command->add_option("-j,--threads", arguments->threads, "Number of threads; 0 uses every processor")
      ->type_name("N")
      ->check(CLI::Range(0, 1024));
  command->add_flag("-q,--quiet", arguments->quiet, "Print only warnings and errors");
  command->footer(
      "Prints the address; Ctrl-C ends the simulation.\n\n"
      "Examples:\n"
      "  esim serve scenes/poster.yaml --loop\n"
      "  esim serve scenes/room.yaml --speed 0.2                 slow motion\n"
      "  esim serve scenes/room.yaml --live-pose --set sampling.min_rate_hz=200\n"
      "  ROS_LOCALHOST_ONLY=1 ros2 topic hz /cam0/events         beside: esim serve scenes/poster.yaml --loop --ros2");
  command->callback([arguments, &exit_code] { exit_code = run(*arguments); });
}

}  // namespace esim::app
