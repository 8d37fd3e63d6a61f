#include "simulation/simulation.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "esim/core/error.h"
#include "esim/files/output_file.h"
#include "esim/recording/fan_out.h"
#include "esim/recording/keep_on_failure.h"
#include "esim/scenario/read.h"

namespace esim::python {
namespace {

namespace nb = nanobind;

constexpr double kSignalInterval_s = 0.02;

/// Forwards everything to sinks that it does not own.
class Both final : public Sink {
 public:
  Both(Sink& first, Sink* second) : first_(first), second_(second) {}

  void begin(const RecordingInfo& info) override {
    first_.begin(info);
    if (second_ != nullptr) second_->begin(info);
  }
  void write(const Record& record) override {
    first_.write(record);
    if (second_ != nullptr) second_->write(record);
  }
  void end(bool complete) override {
    first_.end(complete);
    if (second_ != nullptr) second_->end(complete);
  }

 private:
  Sink& first_;
  Sink* second_;
};

PeriodicClock packet_clock(const World& world, TimeNs packet) {
  if (packet > 0) return {world.info.start, world.info.end, 1 / to_seconds(packet)};
  if (world.info.truth_rate_hz > 0) return world.truth_clock;
  return {world.info.start, world.info.end, kUsualPacketRate_hz};
}

}  // namespace

Simulation::Simulation(Scenario scenario, const Substitutes& substitutes, std::optional<PythonFunction> render,
                       const std::string& origin, const SimulationOptions& options)
    : scenario_(std::move(scenario)), render_(std::move(render)) {
  const nb::gil_scoped_release released;
  build(substitutes, origin, options);
}

Simulation::~Simulation() {
  try {
    close();
  } catch (const std::exception&) {  // a destructor cannot report it
  }
  const nb::gil_scoped_release released;  // this may wait for a recorder's thread
  simulator_.reset();
  sink_.reset();
  recorder_.reset();
  world_.reset();
  directory_.reset();
}

void Simulation::build(const Substitutes& substitutes, const std::string& origin, const SimulationOptions& options) {
  if (!options.out.empty()) directory_ = std::make_unique<RecordingDirectory>(options.out, options.force);
  Notices notices;
  notices.warning = [this](const std::string& text) {
    warnings_.push_back(text);
    notices_.push_back("warning: " + text);
  };
  notices.note = [this](const std::string& text) { notices_.push_back(text); };
  std::optional<UsedFilesListener> listener;
  if (directory_ != nullptr) {
    provenance_ = std::make_unique<ProvenanceRecorder>(options.repetition);
    provenance_->add(scenario_.files);
    listener.emplace([this](const UsedFile& file) { provenance_->add(file); });
  }
  live_ = options.live;
  if (live_ != nullptr) {
    world_ = std::make_unique<World>(options.scene != nullptr
                                         ? build_world(scenario_, *options.scene, live_, options.threads, notices)
                                         : build_world(scenario_, live_, options.threads, notices));
  } else {
    if (!substitutes.make_renderer) cache_ = open_image_cache(options.images, scenario_.renderer, notices.warning);
    world_ = std::make_unique<World>(build_world(scenario_, substitutes, options.threads, notices, cache_));
  }
  packets_ = std::make_unique<PacketSink>(packet_clock(*world_, options.packet));
  if (directory_ != nullptr) {
    write_file_atomically(directory_->path() / "scenario.yaml", origin + write_scenario(scenario_));
    recorder_ = build_sink(scenario_, directory_->path());
    samples_ = std::make_unique<SampleStores>(scenario_, directory_->path(), *world_);
  }
  sink_ = std::make_unique<Both>(*packets_, recorder_.get());
  simulator_ = std::make_unique<Simulator>(*world_, *sink_);
}

/// Whether a signal handler, such as that of Ctrl-C, raised an exception. Takes the GIL.
bool Simulation::signal_came() {
  const nb::gil_scoped_acquire acquired;
  if (PyErr_CheckSignals() == 0) return false;
  signal_.emplace();
  return true;
}

void Simulation::push(const SE3& T_world_body) {
  if (over_) throw UserError("the simulation has ended");
  live_->push(T_world_body);
}

/// Simulates until there is a packet, the end, or the last known pose; false if a signal came first.
bool Simulation::advance() {
  const bool reaches_end = live_ == nullptr || live_->final_until() >= world_->info.end;
  const bool all = simulator_->advance_until(world_->info.end, [this](const Progress& progress) {
    packets_->know(progress.now);
    recorded_ |= progress.now > progress.start;
    if (progress.wall_seconds - looked_at_ >= kSignalInterval_s) {
      looked_at_ = progress.wall_seconds;
      if (signal_came()) return false;
    }
    return !packets_->has_packet();
  });
  if (all && reaches_end) finish();
  return !signal_;
}

/// Ends the recording at the current time.
void Simulation::finish() {
  over_ = true;
  Summary summary = simulator_->finish();
  summary.engine_images = engine_images(cache_);
  if (samples_ != nullptr && summary.complete) samples_->finish();
  simulator_.reset();
  losses_ = esim::losses(scenario_, summary);
  for (const std::string& loss : losses_) notices_.push_back("warning: " + loss);
  std::ranges::copy(hints(scenario_, summary), std::back_inserter(notices_));
  std::optional<Provenance> provenance;
  if (provenance_ != nullptr) provenance = provenance_->finish(summary.complete);
  report_ = report_json(scenario_, summary, world_->workers->threads(), notices_, provenance);
  if (directory_ != nullptr) directory_->finish(report_);
}

/// Works without the GIL. After a fatal error, the recording stays in DIR.incomplete if it contains any records.
template <typename Work>
void Simulation::or_keep_the_recording(const Work& work) {
  const nb::gil_scoped_release released;
  try {
    work();
  } catch (const OutputError& error) {
    throw OutputError(keep_what_was_recorded(error.what()));
  } catch (const std::exception& error) {
    keep_what_was_recorded(error.what());
    throw;
  }
}

/// Returns the problem and the folder of the kept recording.
std::string Simulation::keep_what_was_recorded(const std::string& problem) {
  over_ = true;
  if (directory_ == nullptr || !recorded_) return problem;
  end_incomplete(*recorder_);
  directory_->keep(problem);
  return problem + "; the recording until then is kept: " + directory_->path().string();
}

std::optional<Packet> Simulation::next() {
  if (!packets_->has_packet() && !over_) {
    bool undisturbed = true;
    or_keep_the_recording([&] { undisturbed = advance(); });
    // A signal after the last look would otherwise raise in Python after the packet was taken, and lose it.
    if (!undisturbed || signal_came()) throw *std::exchange(signal_, std::nullopt);
  }
  if (!packets_->has_packet()) return std::nullopt;
  return packets_->take();
}

std::vector<Packet> Simulation::catch_up() {
  std::vector<Packet> packets;
  while (packets_->has_packet() || !over_) {
    if (!packets_->has_packet() && !over_ && !advance()) break;
    if (!packets_->has_packet()) break;
    packets.push_back(packets_->take());
  }
  return packets;
}

void Simulation::close() {
  if (!over_) or_keep_the_recording([&] { finish(); });
}

}  // namespace esim::python
