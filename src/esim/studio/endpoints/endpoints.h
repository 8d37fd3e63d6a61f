#pragma once

#include "esim/studio/recordings/recordings.h"
#include "esim/studio/recordings/runs.h"
#include "esim/studio/recordings/sensor_previews.h"
#include "esim/studio/roots.h"
#include "esim/studio/scene_view/scenes.h"
#include "esim/studio/server/router.h"
#include "esim/studio/studio.h"

// Private to studio.
namespace esim::studio {

/// The state on which requests work.
struct Workshop {
  const Roots& roots;
  SceneStore& scenes;
  Runs& runs;
  Recordings& recordings;
  SensorPreviews& sensors;
  int threads;  ///< 0: every processor
};

// Each function adds the routes of its topic; docs/studio-api.md lists them.
void add_files(Router& router, const Roots& roots, const StudioOptions& options);
void add_pages(Router& router, const std::filesystem::path& folder);
void add_scenarios(Router& router, const Roots& roots);
void add_scenes(Router& router, const Workshop& workshop);
void add_motion(Router& router, const Workshop& workshop);
void add_runs(Router& router, const Workshop& workshop);
void add_recordings(Router& router, const Workshop& workshop);
void add_sensors(Router& router, const Workshop& workshop);

}  // namespace esim::studio
