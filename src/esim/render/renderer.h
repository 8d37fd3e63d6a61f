#pragma once

#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "esim/core/image.h"
#include "esim/core/time.h"
#include "esim/motion/trajectory.h"
#include "esim/render/sample.h"

namespace esim::inline render {

/// The pixels of one camera that are evaluated at one time.
struct RenderRequest {
  TimeNs t = 0;
  Kinematics camera;        ///< pose and twist of the camera frame (x right, y down, z forward) at t
  std::vector<Tile> tiles;  ///< disjoint, inside the image, at least one
  std::vector<Kinematics>
      objects{};               ///< pose T_world_object and twist of each moving object at t, in the scene's order
  bool which_objects = false;  ///< store which object each pixel sees even if V does not need it
  int motion_rows = 1;         ///< V is needed in every motion_rows-th row of the image only, from the first

  bool wants_objects() const { return which_objects || !objects.empty(); }
};

/// The smallest unit that a renderer can evaluate without extra cost.
enum class Granularity { tile, frame };

struct RendererTraits {
  std::string name;                             ///< as in the scenario; used in reports
  Granularity granularity = Granularity::tile;  ///< frame: a tile costs as much as the full image
  bool at_infinity = false;                     ///< all surfaces are infinitely far away
  bool has_edges = true;                        ///< surfaces may end in the image
  bool on_sensor = false;  ///< drawn on the sensor: the camera's pose, twist and lens have no effect
  std::string device{};    ///< that it runs on; empty for the processor
  std::string engine{};    ///< on the processor, if there are several
  bool deforms = false;    ///< some objects deform: samples contain the points that are visible

  /// A name to display.
  std::string label() const {
    return name + (engine.empty() ? "" : " (" + engine + ")") + (device.empty() ? "" : " on " + device);
  }
};

/// An evaluation in progress. It must be destroyed before its renderer; finish() may be omitted if the result is not
/// needed.
class Rendering {
 public:
  virtual ~Rendering() = default;

  /// Waits for the result and fills E, Z and V of the request's tiles in `sample`, which is resized to the camera's
  /// image. Call it at most once.
  virtual void finish(Sample& sample) = 0;
};

/// Evaluates a scene as one camera sees it. A renderer belongs to one camera and one scene, and has no history: the
/// same request gives the same sample, whatever was requested before or at the same time, and with any number of
/// threads. The pixels of a tile are the same as in the full frame.
class Renderer {
 public:
  virtual ~Renderer() = default;

  virtual RendererTraits traits() const = 0;

  /// Begins an evaluation, which a graphics card continues while the processor does other work. Any number of
  /// evaluations may be in progress, and be finished in any order. The request must name as many objects as move in the
  /// scene.
  virtual std::unique_ptr<Rendering> start(RenderRequest request) = 0;

  /// Begins to evaluate disjoint tiles at several times into one sample.
  virtual std::unique_ptr<Rendering> start_together(std::vector<RenderRequest> requests);

  /// Starts an evaluation and waits for it.
  void render(RenderRequest request, Sample& sample) { start(std::move(request))->finish(sample); }
};

/// Base of renderers on the processor, which compute when finish() is called.
class ProcessorRenderer : public Renderer {
 public:
  std::unique_ptr<Rendering> start(RenderRequest request) final;
  std::unique_ptr<Rendering> start_together(std::vector<RenderRequest> requests) final;

 private:
  class Postponed;

  /// Fills E, Z and V of the requests' tiles, which are disjoint, in `sample`, which it resizes.
  virtual void compute(std::span<const RenderRequest> requests, Sample& sample) const = 0;
};

}  // namespace esim::inline render
