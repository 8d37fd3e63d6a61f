#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <filesystem>

#include "commands.h"
#include "commands/walk.h"
#include "esim/core/error.h"
#include "esim/scenario/read.h"
#include "support.h"
#include "terminal.h"

namespace esim::app {
namespace {

namespace fs = std::filesystem;
using Effect = Walker::Effect;

constexpr int kLinesBelow = 2;
constexpr int kWait_ms = 200;   // after which the terminal's size is checked
constexpr int kEscape_ms = 40;  // after which an escape character is a key of its own
constexpr int kFrame_ms = 66;   // frame interval while a motion is played

struct WaypointsArguments {
  std::string input, out;
  std::vector<std::string> overrides;
  std::optional<std::string> keys;
  std::vector<double> start;
  double speed_m_per_s = 1.0;
  int threads = 0;
  bool append = false, force = false;
};

/// A scenario, whose trajectory or file of waypoints may be missing, or a scene file.
Scenario read_input(const WaypointsArguments& arguments) {
  ScenarioText text;
  text.needs_trajectory = text.needs_waypoints = false;
  text.overrides = arguments.overrides;
  const std::string extension = fs::path(arguments.input).extension().string();
  if (extension == ".yaml" || extension == ".yml") return read_scenario(arguments.input, text);
  std::error_code error;
  if (!fs::is_regular_file(arguments.input, error))
    throw UserError(fmt::format("{}: must be an existing scenario (.yaml) or scene file", arguments.input));
  text.yaml = "renderer: {type: mesh, scene: \"\"}";
  text.file = arguments.input;
  Scenario scenario = read_scenario(text);
  std::get<MeshRendererOptions>(scenario.renderer).scene = fs::absolute(arguments.input);
  return scenario;
}

/// Executes keys from a text, without a terminal.
void walk_by_keys(Walk& walk, const std::vector<Key>& keys) {
  for (const Key key : keys) {
    if (interrupted()) return;
    const Effect effect = walk.press(key);
    if (effect == Effect::leave) return;
    if (effect == Effect::help) tell(stderr, "{}", key_help());
    if (effect == Effect::play) {
      const WaypointTrajectory motion = walk.motion();
      walk.say(fmt::format("the motion lasts {:.3f} s", to_seconds(motion.end())));
    }
    if (!walk.message().empty()) tell(stderr, "{}\n", walk.message());
  }
}

/// The view and two lines below it, redrawn if anything has changed.
class Screen {
 public:
  explicit Screen(Walk& walk) : walk_(walk), size_(terminal_.size()) {}

  Terminal& terminal() { return terminal_; }

  /// Whether the terminal's size has changed.
  bool resized() {
    const Terminal::Size now = terminal_.size();
    if (now == size_) return false;
    size_ = now;
    clear_ = true;
    return true;
  }

  void draw(const SE3& T_world_camera, const std::string& status, const std::string& message) {
    const int rows = std::max(1, size_.rows - kLinesBelow);
    const std::string picture = half_blocks(walk_.look(T_world_camera, size_.columns, 2 * rows), terminal_.colours());
    terminal_.write((clear_ ? "\033[2J\033[H" : "\033[H") + picture + "\r\n" + line(status) + "\r\n" + line(message));
    clear_ = false;
  }

  void help() {
    terminal_.write("\033[2J\033[H" + with_returns(key_help()) + "\r\npress any key to return");
    clear_ = true;
  }

 private:
  /// A line padded to the width of the terminal.
  std::string line(const std::string& text) const {
    const auto width = static_cast<std::size_t>(std::max(1, size_.columns - 1));
    return fmt::format("{:<{}}", text.substr(0, width), width);
  }

  static std::string with_returns(const std::string& text) {
    std::string result;
    for (const char c : text) result += c == '\n' ? "\r\n" : std::string(1, c);
    return result;
  }

  Walk& walk_;
  Terminal terminal_;
  Terminal::Size size_;
  bool clear_ = true;  // the area outside the image
};

/// Plays the motion at its own speed until a key is pressed.
void play(Walk& walk, Screen& screen) {
  std::optional<WaypointTrajectory> motion;
  try {
    motion = walk.motion();
  } catch (const UserError& error) {
    walk.say(error.what());
    return;
  }
  const auto begin = std::chrono::steady_clock::now();
  while (!interrupted() && !screen.terminal().closed()) {
    const TimeNs t = std::chrono::nanoseconds(std::chrono::steady_clock::now() - begin).count();
    if (t > motion->end()) break;
    screen.resized();
    screen.draw(walk.T_world_camera(*motion, t),
                fmt::format("{:.1f} of {:.1f} s", to_seconds(t), to_seconds(motion->end())), "press any key to stop");
    if (!screen.terminal().read(kFrame_ms).empty()) break;
  }
  walk.say(fmt::format("the motion lasts {:.1f} s", to_seconds(motion->end())));
}

void walk_in_terminal(Walk& walk) {
  Screen screen(walk);
  Terminal& terminal = screen.terminal();
  KeyReader reader;
  walk.say("press ? for the keys");
  bool changed = true, helping = false;
  while (!interrupted() && !terminal.closed()) {
    if (changed && !helping) screen.draw(walk.T_world_camera(), walk.status(), walk.message());
    std::vector<Key> keys = reader.read(terminal.read(kWait_ms));
    if (reader.waits()) {
      const std::string more = terminal.read(kEscape_ms);
      for (const Key key : more.empty() ? reader.finish() : reader.read(more)) keys.push_back(key);
    }
    changed = screen.resized() || !keys.empty();
    for (const Key key : keys) {
      if (helping) {
        helping = false;
        continue;
      }
      const Effect effect = walk.press(key);
      if (effect == Effect::leave) return;
      if (effect == Effect::play) play(walk, screen);
      if (effect == Effect::help) {
        screen.help();
        helping = true;
      }
    }
  }
}

int run(const WaypointsArguments& arguments) {
  std::optional<std::vector<Key>> keys;
  if (arguments.keys) keys = keys_of(*arguments.keys);
  if (!keys && !Terminal::is_there()) {
    throw UserError(
        "waypoints: standard input and output must be a terminal; run it in one, or give the keys with --keys \"wwd "
        "x\"");
  }
  WalkFile file(arguments.out, arguments.append, arguments.force);
  const Scenario scenario = read_input(arguments);
  catch_interrupts();
  std::vector<std::string> given;
  SceneView view(scenario, arguments.threads, print_and_keep(given, true));
  std::optional<Eigen::Vector3d> start;
  if (!arguments.start.empty()) start = Eigen::Vector3d::Map(arguments.start.data());
  Walk walk(std::move(file), view, start, arguments.speed_m_per_s);
  if (keys) {
    walk_by_keys(walk, *keys);
  } else {
    walk_in_terminal(walk);
  }
  walk.print_summary(arguments.input);
  return interrupted() ? kInterrupted : kOk;
}

}  // namespace

void add_waypoints(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<WaypointsArguments>();
  CLI::App* command = app.add_subcommand("waypoints", "Walk through a scene in the terminal and set waypoints");
  command->add_option("in", arguments->input, "Scenario, seen through its first camera, or scene file")
      ->required()
      ->type_name("SCENARIO.yaml|SCENE");
  command->add_option("-o,--out", arguments->out, "File of waypoints, saved after each waypoint")
      ->required()
      ->type_name("WALK.yaml");
  command->add_flag("--append", arguments->append, "Continue an existing file");
  command->add_flag("--force", arguments->force, "Replace an existing file");
  command
      ->add_option("--start", arguments->start,
                   "Initial position of the camera, m (default: the start of the trajectory)")
      ->type_name("X Y Z")
      ->expected(3)
      ->check(CLI::Range(-1e6, 1e6));
  command->add_option("--speed", arguments->speed_m_per_s, "Walking speed, m/s; each key press is a step of 0.1 s")
      ->capture_default_str()
      ->type_name("V")
      ->check(CLI::Range(0.01, 100.0));
  command
      ->add_option("--keys", arguments->keys,
                   "Keys to press instead of a terminal, as one would type them; a space sets a waypoint; "
                   "<left>, <right>, <up>, <down>, <space>, <esc>")
      ->type_name("KEYS");
  command->add_option("--set", arguments->overrides, "Change one option of the scenario")
      ->type_name("KEY=VALUE")
      ->expected(1)
      ->take_all();
  command->add_option("-j,--threads", arguments->threads, "Number of threads; 0 uses every processor")
      ->type_name("N")
      ->check(CLI::Range(0, 1024));
  command->footer("Keys:\n" + key_help() +
                  "\nExamples:\n"
                  "  esim waypoints scenes/room.yaml --out walk.yaml\n"
                  "  esim waypoints room.glb --out walk.yaml --start 0 0 1.6\n"
                  "  esim waypoints scenes/room.yaml --out walk.yaml --append\n"
                  "  esim waypoints scenes/room.yaml --out walk.yaml --keys \" wwwwww<left><left> x\"");
  command->callback([arguments, &exit_code] { exit_code = run(*arguments); });
}

}  // namespace esim::app
