#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "esim/compose/provenance.h"
#include "esim/formats/filter_recording.h"
#include "esim/image_cache/image_cache.h"
#include "esim/light/flicker.h"
#include "esim/recording/format.h"
#include "esim/render/pixel_area.h"
#include "esim/sampling/context.h"
#include "esim/scenario/conversion.h"
#include "esim/scenario/scenario.h"
#include "esim/scene/scene_file.h"
#include "esim/sim/convert.h"
#include "esim/sim/simulate.h"
#include "esim/sim/world.h"

/// From a scenario to a recording. simulate() (sim/simulate.h) runs the world that build_world() builds.
namespace esim::inline compose {

/// Receives one line that the user should know about; the program continues.
using NoticeHandler = std::function<void(const std::string&)>;

/// The receivers of warnings and notes while a world is built.
struct Notices {
  NoticeHandler warning;  ///< something is probably not as intended
  NoticeHandler note;     ///< something was chosen or measured
};

/// Forwards notices, and appends them to `given` for reports.
Notices keeping(Notices notify, std::vector<std::string>& given);

// --- the world (build_world.cpp) -------------------------------------------------------------------------------------

/// Builds everything that a scenario describes, ready to simulate on `threads` threads (0: every processor). Loads
/// scenes and trajectories, and checks everything that can be checked before the simulation. Throws UserError for
/// problems that the user can repair. `cache`: of the images of engines; null: each is rendered.
World build_world(const Scenario& scenario, int threads, const Notices& notices,
                  const std::shared_ptr<ImageCache>& cache = nullptr);

/// The same for a body that moves along `body` instead of the scenario's trajectory. Only the beginning of `body` may
/// be known yet. The scenario needs a duration_s.
World build_world(const Scenario& scenario, std::shared_ptr<const Trajectory> body, int threads,
                  const Notices& notices);

struct LoadedScene;

/// The scene of a scenario with its renderers, for several worlds at once, whose bodies move differently.
std::shared_ptr<const LoadedScene> load_scene(const Scenario& scenario, const Notices& notices);

/// The same with the scene of a scenario with the same renderer and cameras.
World build_world(const Scenario& scenario, const LoadedScene& loaded, std::shared_ptr<const Trajectory> body,
                  int threads, const Notices& notices);

/// Parts that replace those of a scenario, if set.
struct Substitutes {
  std::shared_ptr<const Trajectory> body;  ///< completely known

  /// Replaces the scenario's renderer, with its scenes and objects. The workers are those of the world, which outlives
  /// its renderers.
  std::function<std::unique_ptr<Renderer>(const Camera& camera, const Workers& workers)> make_renderer;

  /// A moving object of make_renderer's renderers, in the order of RenderRequest::objects. Trajectories cover the
  /// simulated time.
  struct Object {
    std::string name;
    std::shared_ptr<const Trajectory> trajectory;
  };
  std::vector<Object> objects;
};

/// The same with substitutes. Throws UserError if the scenario has an option that custom renderers do not support.
World build_world(const Scenario& scenario, const Substitutes& substitutes, int threads, const Notices& notices,
                  const std::shared_ptr<ImageCache>& cache = nullptr);

/// The part of the body's trajectory that a scenario simulates. Throws UserError if the trajectory does not cover it.
TimeSpan simulated_span(const Scenario& scenario, const Trajectory& trajectory);

/// The numbers of the event sensors of each camera in RecordingInfo::cameras: that of the camera itself for a sensor
/// without a name; sensors with names come after all cameras.
std::vector<std::vector<int>> sensor_numbers(const Scenario& scenario);

/// What a camera's sampler and its lights must suit: the smallest threshold and the smallest dark light of its sensors.
SensorTraits strictest_sensor(const Scenario& scenario, const CameraOptions& camera);

/// Whether the samples of a camera depend on strictest_sensor(), by its sampling method.
bool sampling_depends_on_sensors(const CameraOptions& camera);

/// Whether the scenario's seed determines more than the noise of its event sensors: a random trajectory, the noise of
/// an IMU or of a frame camera.
bool seed_determines_more_than_events(const Scenario& scenario);

/// A camera as it is recorded. If its options give no field of view, it has that of the followed camera (may be null).
CameraInfo camera_info(CameraOptions options, const SceneCamera* followed);

// --- scenes and motions (load_scenes.cpp, build_trajectories.cpp) ----------------------------------------------------

/// The contents of the scene files of a scenario's renderer: for a mesh renderer, the objects of the scene file
/// followed by those that the scenario lists; for Blender, only the cameras, and only if the trajectory follows one.
/// Empty for renderers without scene files. Notes describe the contents.
SceneFile load_scenes(const Scenario& scenario, SceneLook look, const Notices& notices);

/// Sets when the deformations of a loaded scene are played: in the time of the simulation instead of the file's, from
/// the start of the body's trajectory on, as its other animations (see build_object_trajectories).
void play_deformations(const Scenario& scenario, TimeNs body_start, SceneFile& file);

/// The motion of the body that a scenario describes.
std::shared_ptr<const Trajectory> build_trajectory(const Scenario& scenario, const SceneFile& scene,
                                                   const Notices& notices);

/// The same with the scene of a scenario with the same renderer.
std::shared_ptr<const Trajectory> build_trajectory(const Scenario& scenario, const LoadedScene& loaded,
                                                   const Notices& notices);

/// The camera of the scene file that the scenario's trajectory follows; null for trajectories of other types. Throws
/// UserError with the names of the cameras in the file.
const SceneCamera* followed_camera(const Scenario& scenario, const SceneFile& scene);

/// The motions of the moving objects that a scenario's renderer shows, in the renderer's order. All cover `simulated`.
/// Trajectories that do not define a duration, and the scene file's animation, begin with the body's trajectory. After
/// the end of its animation, an object of the scene file rests.
std::vector<std::shared_ptr<const Trajectory>> build_object_trajectories(const Scenario& scenario,
                                                                         const SceneFile& scene, const Trajectory& body,
                                                                         const TimeSpan& simulated,
                                                                         const Notices& notices);

// --- renderers (renderer_factory.cpp, engines/) ----------------------------------------------------------------------

/// Makes the renderers of a scenario's cameras, which share one loaded scene.
struct RendererFactory {
  /// Throws UserError for colour filters that the renderer does not support.
  std::function<std::unique_ptr<Renderer>(const Camera& camera, ColourFilters filters, const Workers& workers)> make;

  /// A renderer whose pixels average over `area`; null if they cannot. May be empty if they never can.
  std::function<std::unique_ptr<Renderer>(const Camera& camera, const PixelArea& area, const Workers& workers)>
      make_with_area{};
};

/// Cameras may have colour filters if `colour`. `sensors`: the cameras of the scenario; samplers may need others.
RendererFactory build_renderer_factory(const RendererOptions& options, const SceneFile& scene, bool colour,
                                       const std::vector<CameraInfo>& sensors, const Notices& notices,
                                       const std::shared_ptr<ImageCache>& cache = nullptr);

/// Starts Blender, which runs as long as any renderer of the factory, or connects to a running one.
RendererFactory start_blender(const BlenderRendererOptions& options, const std::vector<CameraInfo>& sensors,
                              const Notices& notices, std::shared_ptr<ImageCache> cache);

/// Whether and where the images of engines (Blender, UnrealCV) are kept, so that none is rendered twice.
struct ImageCacheOptions {
  bool use = true;
  std::filesystem::path folder{};            ///< empty: images/ in esim's cache folder, and only for scenes that esim
                                             ///< can identify: .blend, .glb and .ply files that it opens in Blender
  std::uint64_t max_bytes = 10'000'000'000;  ///< of the folder
};

/// The cache for a scenario's renderer; null without a cache.
std::shared_ptr<ImageCache> open_image_cache(const ImageCacheOptions& options, const RendererOptions& renderer,
                                             const NoticeHandler& warning);

/// What the renderers with a cache have delivered; empty without a cache.
std::optional<EngineImages> engine_images(const std::shared_ptr<ImageCache>& cache);

// --- light (build_light.cpp) -----------------------------------------------------------------------------------------

/// Whether any light of a scenario flickers.
bool flickers(const Scenario& scenario);

/// How exactly flickering light is divided: as each of the camera's event sensors requires.
LightAccuracy light_accuracy(const CameraOptions& camera);

/// The flicker of a scenario's lights as one of its cameras sees it; empty if the light is constant. `moving`: number
/// of moving objects, of which the scenario's own are the last. Throws UserError, naming the option, for values out of
/// range.
std::optional<Flicker> build_flicker(const Scenario& scenario, const CameraOptions& camera, std::size_t moving,
                                     TimeNs start);

// --- ground truth (prepare_truth.cpp) --------------------------------------------------------------------------------

/// Sets up the ground truth of a world with cameras. Throws UserError if the renderer cannot provide it.
void prepare_truth(const Scenario& scenario, const SceneFile& scene, const RendererFactory& make_renderer,
                   const Notices& notices, World& world);

// --- files (recordings/build_sinks.cpp) ------------------------------------------------------------------------------

/// Throws UserError for unknown names in output.formats.
void check_output(const Scenario& scenario);

/// The files of a recording in `folder`: the files of the rig at its top, those of each camera in a folder of its name.
std::unique_ptr<Sink> build_sink(const Scenario& scenario, const std::filesystem::path& folder);

/// The files of a converted video in `folder`.
std::unique_ptr<Sink> build_conversion_sink(const std::filesystem::path& folder);

/// One file of a format.
std::unique_ptr<Sink> build_conversion_sink(const std::filesystem::path& file, const Format& format);

// --- samples (samples/) ----------------------------------------------------------------------------------------------

/// Keeps the samples of a world, for resense(), in the folders of its cameras if the scenario requests it. It must
/// outlive the simulation.
class SampleStores {
 public:
  /// `resumed`: a state() of the stores in the folder, which are continued from there; empty: new stores.
  SampleStores(const Scenario& scenario, const std::filesystem::path& folder, World& world,
               std::span<const std::vector<std::byte>> resumed = {});
  ~SampleStores();
  SampleStores(const SampleStores&) = delete;
  SampleStores& operator=(const SampleStores&) = delete;

  /// What is needed to continue the stores after the samples so far; one for each.
  std::vector<std::vector<std::byte>> state();

  /// Completes the stores of a complete simulation.
  void finish();

 private:
  struct Store;
  std::vector<std::unique_ptr<Store>> stores_;
};

/// New events from the samples of a recording.
struct Resensed {
  Summary summary;
  bool exact = false;  ///< the events are those of a simulation with the same options
};

/// Options of resense().
struct ResenseOptions {
  std::filesystem::path recording{};     ///< with samples
  std::filesystem::path out{};           ///< the folder of the new recording
  bool replace = false;                  ///< an existing one
  int threads = 0;                       ///< 0: every processor
  std::vector<std::string> overrides{};  ///< "key=value"
  std::string setter{};                  ///< beginning of messages about these
  Repetition repetition{};               ///< for the report
};

/// Makes a recording with the events that other sensors, or the same ones with other options, have of the samples of a
/// recording, without a renderer. The overrides may change the event sensors, the light's unit and the output; those of
/// `event_camera` apply to all sensors of all cameras, and a preset replaces all their options. A notice says whether
/// the events are exact, and why not. Throws UserError for other overrides and for recordings without complete samples.
Resensed resense(const ResenseOptions& options, const Notices& notify, const Monitor& monitor);

// --- reports (recordings/recording_report.cpp, recordings/losses_and_hints.cpp) --------------------------------------

/// The text of report.json: results, cost, time by stage, notices, and of recordings, their provenance.
std::string report_json(const Scenario& scenario, const Summary& summary, int threads,
                        const std::vector<std::string>& notices, const std::optional<Provenance>& provenance = {});

/// The text of report.json of a conversion.
std::string report_json(const ConversionOptions& options, const ConversionSummary& summary, int threads,
                        const std::vector<std::string>& notices, const std::optional<Provenance>& provenance = {});

/// One line for each filter of a sensor that the real sensor of its preset does not have.
std::vector<std::string> warnings_of_filters(const EventCameraOptions& sensor);

/// The events that the filters of each camera have received and dropped; cameras without filters are omitted.
std::vector<FilteredCamera> filtered_cameras(const Summary& summary);
std::vector<FilteredCamera> filtered_cameras(const ConversionSummary& summary);

/// Losses of a simulation or a conversion: events that the readout dropped or delayed, samples limited by the maximum
/// rate, a tolerance that was not met. One line each, with the option that controls it.
std::vector<std::string> losses(const Scenario& scenario, const Summary& summary);
std::vector<std::string> losses(const ConversionOptions& options, const ConversionSummary& summary);

/// Warns if the noise of a sensor's circuit fires its pixels all the time. `name` precedes the message.
void warn_of_noise(const std::string& name, const EventCameraOptions& options, const Notices& notices);

/// Faster alternatives, one line each: flow sampling, if adaptive sampling of a mesh was slower than real time because
/// of rendering.
std::vector<std::string> hints(const Scenario& scenario, const Summary& summary);

// --- all together (recordings/make_recording.cpp) --------------------------------------------------------------------

/// Options of make_recording().
struct RecordingOptions {
  std::filesystem::path out{};  ///< the recording's folder
  bool replace = false;         ///< an existing recording
  bool resume = false;          ///< continue one that ended early, from its last checkpoint
  int threads = 0;              ///< 0: every processor

  std::unique_ptr<Sink> beside{};  ///< if set, receives every record too
  Repetition repetition{};         ///< for the report
  ImageCacheOptions images{};      ///< of engines
};

/// Simulates a scenario into a recording's folder with scenario.yaml and report.json, as `esim simulate` does. The
/// monitor can end it early. It is called once before the first sample, when everything has been loaded; if it returns
/// false then, nothing is kept and the result is empty. The folder appears only with the finished recording; see
/// RecordingDirectory. The report contains the notices, and also losses and hints, which `notify` does not receive.
std::optional<Summary> make_recording(const Scenario& scenario, RecordingOptions options, const Notices& notify,
                                      const Monitor& monitor);

/// Whether the folder of a recording that ended early has a checkpoint, from which it can be resumed.
bool can_be_resumed(const std::filesystem::path& recording);

// --- videos (make_conversion.cpp) ------------------------------------------------------------------------------------

/// Where a conversion writes, and what it needs beside its options.
struct ConversionOutput {
  std::filesystem::path out{};  ///< a recording's folder, or a file of events
  bool replace = false;         ///< existing output
  int threads = 0;              ///< 0: every processor

  /// Makes the images between frames, in place of the options' model; may be null.
  std::unique_ptr<FrameInterpolator> interpolator{};

  Repetition repetition{};  ///< for the report

  /// Called at the end of the conversion, to say what its options can improve.
  std::function<void(const ConversionSummary&, const Notices&)> comment = [](const auto&, const auto&) {};
};

/// A conversion, and the text of its report.json.
struct MadeConversion {
  ConversionSummary summary;
  std::string report;
};

/// Converts a video to a recording's folder with video.yaml and report.json, or to one file of events, as `esim video`
/// does. The monitor can end it early. The report contains the notices. Throws UserError for unusable input and
/// options; a frame that becomes unusable later ends the conversion as incomplete, with the problem in the summary.
MadeConversion make_conversion(const ConversionOptions& options, ConversionOutput output, const Notices& notify,
                               const Monitor& monitor);

}  // namespace esim::inline compose
