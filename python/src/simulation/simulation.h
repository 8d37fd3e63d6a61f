#pragma once

#include <nanobind/nanobind.h>

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "esim/compose/compose.h"
#include "esim/motion/online.h"
#include "esim/recording/recording_directory.h"
#include "events/packet_sink.h"
#include "simulation/python_renderer.h"

namespace esim::python {

/// Parameters of a simulation in addition to its scenario.
struct SimulationOptions {
  int threads = 0;
  TimeNs packet = 0;          ///< length of packets; 0: from one frame of ground truth to the next
  std::filesystem::path out;  ///< folder of the recording; empty: none is written
  bool force = false;         ///< replace an existing recording
  Repetition repetition{};    ///< for the report of the recording
  ImageCacheOptions images{};
  std::shared_ptr<OnlineTrajectory> live{};    ///< the motion of the body, if it becomes known during the simulation
  std::shared_ptr<const LoadedScene> scene{};  ///< of a live simulation; unset: the scenario's is loaded
};

/// A simulation packet by packet. Callers hold the GIL, which is released during the simulation.
class Simulation {
 public:
  /// `origin` is text above the written scenario; `render` is the Python function of the substitutes' renderer.
  Simulation(Scenario scenario, const Substitutes& substitutes, std::optional<PythonFunction> render,
             const std::string& origin, const SimulationOptions& options);
  ~Simulation();

  /// Adds the next pose of the body of a live simulation.
  void push(const SE3& T_world_body);

  /// Simulates a live simulation as far as its motion is known, on any thread, without the GIL. Returns the complete
  /// packets.
  std::vector<Packet> catch_up();

  /// Throws the exception of a signal handler that stopped catch_up(). Needs the GIL.
  void raise_signal() {
    if (signal_) throw nanobind::python_error(*std::exchange(signal_, std::nullopt));
  }

  /// The next packet; empty after the last, and in live simulations also before later poses are known. Throws the
  /// Python exception of a signal handler or a renderer; after a signal, the simulation can continue.
  std::optional<Packet> next();

  /// Ends the simulation and the recording at the current time.
  void close();

  const RecordingInfo& info() const { return world_->info; }
  bool colour(std::size_t camera) const { return scenario_.cameras[camera].colour != ColourFilters::none; }
  const std::vector<std::string>& warnings() const { return warnings_; }

  /// The Python objects held here, for the garbage collector.
  std::optional<PythonFunction>& render() { return render_; }

  /// One line per loss; empty before the end.
  const std::vector<std::string>& losses() const { return losses_; }

  /// The report as JSON; empty before the end.
  const std::string& report() const { return report_; }

 private:
  void build(const Substitutes& substitutes, const std::string& origin, const SimulationOptions& options);
  bool advance();
  void finish();
  template <typename Work>
  void or_keep_the_recording(const Work& work);
  std::string keep_what_was_recorded(const std::string& problem);
  bool signal_came();

  Scenario scenario_;
  std::optional<PythonFunction> render_;
  std::vector<std::string> warnings_, notices_, losses_;
  std::unique_ptr<RecordingDirectory> directory_;
  std::unique_ptr<ProvenanceRecorder> provenance_;  // of the recording
  std::shared_ptr<ImageCache> cache_;
  std::shared_ptr<OnlineTrajectory> live_;
  std::unique_ptr<World> world_;
  std::unique_ptr<PacketSink> packets_;
  std::unique_ptr<Sink> recorder_, sink_;
  std::unique_ptr<SampleStores> samples_;
  std::unique_ptr<Simulator> simulator_;
  std::optional<nanobind::python_error> signal_;
  double looked_at_ = 0;  // wall-clock time of the last check for signals, s
  std::string report_;
  bool over_ = false;
  bool recorded_ = false;  // whether any record was written
};

}  // namespace esim::python
