#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "esim/record/format.h"
#include "esim/scenario/conversion.h"
#include "esim/scenario/scenario.h"
#include "esim/scene/scene_file.h"
#include "esim/sim/convert.h"
#include "esim/sim/simulate.h"
#include "esim/sim/world.h"

namespace esim {

/// Receives one line about something that the user should know but that stops nothing.
using NoticeHandler = std::function<void(const std::string&)>;

/// Who is told what while a world is built.
struct Notices {
  NoticeHandler warning;  ///< something is probably not as meant
  NoticeHandler note;     ///< something was chosen or measured
};

/// Passes notices on, and keeps them in `given`, for reports.
Notices keeping(Notices notify, std::vector<std::string>& given);

/// Builds everything that a scenario describes, ready to simulate on `threads` threads (0: every processor). Loads
/// scenes and trajectories, and checks what can be checked beforehand. Throws UserError for whatever the user can
/// repair.
World build_world(const Scenario& scenario, int threads, const Notices& notices);

/// The same for a body that moves as `body`, of which only the beginning may be known yet, whatever the scenario's
/// trajectory. The scenario needs a duration_s.
World build_world(const Scenario& scenario, std::shared_ptr<const Trajectory> body, int threads,
                  const Notices& notices);

/// What stands in place of what a scenario says, where it is set.
struct Substitutes {
  std::shared_ptr<const Trajectory> body;  ///< known from its start to its end

  /// Beside it, the scenario's renderer counts for nothing: neither its scenes nor its objects.
  std::function<std::unique_ptr<Renderer>(const Camera& camera)> make_renderer;

  /// Of make_renderer's: what moves, in the order of RenderRequest::objects. Trajectories cover the simulated time.
  struct Object {
    std::string name;
    std::shared_ptr<const Trajectory> trajectory;
  };
  std::vector<Object> objects;
};

/// The same with substitutes. Throws UserError where the scenario asks for what a renderer of somebody else cannot do.
World build_world(const Scenario& scenario, const Substitutes& substitutes, int threads, const Notices& notices);

/// What the scene files of a scenario's renderer hold: a mesh renderer's scene with all its objects, those that the
/// scenario lists after the scene file's own; of what Blender renders, the cameras, where the trajectory follows one.
/// Empty for renderers without scene files. Notes say what was found.
SceneFile load_scenes(const Scenario& scenario, SceneLook look, const Notices& notices);

/// The motion of the body that a scenario describes.
std::shared_ptr<const Trajectory> build_trajectory(const Scenario& scenario, const SceneFile& scene,
                                                   const Notices& notices);

/// The part of the body's trajectory that a scenario simulates. Throws UserError where it is not within it.
TimeSpan simulated_span(const Scenario& scenario, const Trajectory& trajectory);

/// The camera of the scene file that the scenario's trajectory follows; null for trajectories from elsewhere. Throws
/// UserError naming those that there are.
const SceneCamera* followed_camera(const Scenario& scenario, const SceneFile& scene);

/// A camera as it is recorded: its field of view is that of the scene's camera, where it follows one (null: none) and
/// says nothing itself.
CameraInfo camera_info(CameraOptions options, const SceneCamera* followed);

/// The motions of the moving objects that a scenario's renderer shows, in the order in which the renderer wants them.
/// All cover `simulated`; what has no duration of its own, and the scene file's animation, begin with the body's
/// trajectory. What is animated in the scene file rests after its animation's end.
std::vector<std::shared_ptr<const Trajectory>> build_object_trajectories(const Scenario& scenario,
                                                                         const SceneFile& scene, const Trajectory& body,
                                                                         const TimeSpan& simulated,
                                                                         const Notices& notices);

/// Makes the renderers of a scenario's cameras; what they show is loaded once and shared. Throws UserError for filters
/// that the renderer cannot look through.
using RendererFactory =
    std::function<std::unique_ptr<Renderer>(const Camera& camera, ColourFilters filters, const Workers& workers)>;

/// Cameras may have colour filters if `colour`. Renderers are made for the sensors, and for cameras that are denser.
RendererFactory build_renderer_factory(const RendererOptions& options, const SceneFile& scene, bool colour,
                                       const std::vector<CameraInfo>& sensors, const Notices& notices);

/// Starts Blender, which runs as long as any renderer of the factory's, or finds the one that runs already.
RendererFactory start_blender(const BlenderRendererOptions& options, const std::vector<CameraInfo>& sensors,
                              const Notices& notices);

/// Gives a world with cameras the ground truth that its scenario asks for. Throws UserError where that cannot be had.
void prepare_truth(const Scenario& scenario, const SceneFile& scene, const RendererFactory& make_renderer,
                   const Notices& notices, World& world);

/// Throws UserError for formats that a scenario asks for and that there are not.
void check_output(const Scenario& scenario);

/// The files of a recording, to be written into `folder`: those of the rig at its top, those of a camera in a folder of
/// its name.
std::unique_ptr<Sink> build_sink(const Scenario& scenario, const std::filesystem::path& folder);

/// The files of a converted video, to be written into `folder`, likewise.
std::unique_ptr<Sink> build_conversion_sink(const std::filesystem::path& folder);

/// One file of a format.
std::unique_ptr<Sink> build_conversion_sink(const std::filesystem::path& file, const Format& format);

/// report.json: what was done, at which cost, where the time went, and the notices given on the way.
std::string report_json(const Scenario& scenario, const Summary& summary, int threads,
                        const std::vector<std::string>& notices);

/// What a simulation, or a conversion, left out or missed: events that the readout dropped or that waited for it,
/// samples held to the maximum rate, a tolerance that was not met. One line each, with the option that governs it; none
/// where everything is as asked for.
std::vector<std::string> losses(const Scenario& scenario, const Summary& summary);
std::vector<std::string> losses(const ConversionOptions& options, const ConversionSummary& summary);

/// What would have been faster, one line each: flow sampling, where adaptive sampling of a mesh was slower than real
/// time because of rendering.
std::vector<std::string> hints(const Scenario& scenario, const Summary& summary);

/// How a recording is made.
struct RecordingOptions {
  std::filesystem::path out{};  ///< the recording's folder
  bool replace = false;         ///< what is there already
  int threads = 0;              ///< 0: every processor

  std::unique_ptr<Sink> beside{};  ///< sees all that is recorded, where set
};

/// Simulates a scenario into a recording's folder, with its scenario.yaml and its report.json: what `esim simulate`
/// does. The monitor, which ends it early, is asked once more when everything has been loaded, with a progress of
/// nothing: nothing is kept then, and nothing is returned. The folder is there only when the recording is; see
/// RecordingDirectory. What is notified stands in the report too, and losses and hints beside it, which are not
/// notified.
std::optional<Summary> make_recording(const Scenario& scenario, RecordingOptions options, const Notices& notify,
                                      const Monitor& monitor);

/// The same of a conversion.
std::string report_json(const ConversionOptions& options, const ConversionSummary& summary, int threads,
                        const std::vector<std::string>& notices);

}  // namespace esim
