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

namespace esim {

/// What to evaluate: some pixels of one camera at one time.
struct RenderRequest {
  TimeNs t = 0;
  Kinematics camera;        ///< pose and twist of the camera frame (x right, y down, z forward) at t
  std::vector<Tile> tiles;  ///< disjoint, inside the image, at least one
  std::vector<Kinematics>
      objects{};               ///< pose T_world_object and twist of each moving object at t, in the scene's order
  bool which_objects = false;  ///< say which object each pixel sees also where that is not needed for V
  int motion_rows = 1;         ///< V is wanted of one row in so many, from the image's first on

  bool wants_objects() const { return which_objects || !objects.empty(); }
};

/// The smallest thing that a renderer can evaluate at its proper cost.
enum class Granularity { tile, frame };

struct RendererTraits {
  std::string name;                             ///< as in the scenario, for reports
  Granularity granularity = Granularity::tile;  ///< frame: asking for a tile costs as much as the whole image
  bool at_infinity = false;                     ///< everything that it shows is infinitely far away
  bool on_sensor = false;    ///< drawn on the sensor: the camera's pose, twist and lens change nothing
  bool wide_pixels = false;  ///< averages over the camera's footprint also where that is more than a pixel
  std::string device{};      ///< that it runs on, where that is not simply the processor

  /// For people.
  std::string label() const { return device.empty() ? name : name + " on " + device; }
};

/// An evaluation under way. It ends before its renderer does; one that is no longer wanted need not be finished.
class Rendering {
 public:
  virtual ~Rendering() = default;

  /// Waits until it is done, and fills E, Z and V of the request's tiles in `sample`, which is resized to the camera's
  /// image. To be called once at most.
  virtual void finish(Sample& sample) = 0;
};

/// Evaluates a scene as one camera sees it. A renderer is made for one camera and one scene, keeps no history, and
/// never chooses a time: the same request gives the same sample, whatever was asked before, whatever else is under way,
/// and with any number of threads, and a tile's pixels are the same as in the whole frame.
class Renderer {
 public:
  virtual ~Renderer() = default;

  virtual RendererTraits traits() const = 0;

  /// Begins an evaluation, which a graphics card goes on with while the processor does other things. Any number may be
  /// under way, and be finished in any order. The request names as many objects as move in the scene.
  virtual std::unique_ptr<Rendering> start(RenderRequest request) = 0;

  /// Begins to evaluate disjoint tiles of several times, into one sample.
  virtual std::unique_ptr<Rendering> start_together(std::vector<RenderRequest> requests);

  /// Starts and finishes at once.
  void render(RenderRequest request, Sample& sample) { start(std::move(request))->finish(sample); }
};

/// What renderers on the processor derive from: they compute when the sample is wanted.
class ProcessorRenderer : public Renderer {
 public:
  std::unique_ptr<Rendering> start(RenderRequest request) final;
  std::unique_ptr<Rendering> start_together(std::vector<RenderRequest> requests) final;

 private:
  class Postponed;

  /// Fills E, Z and V of the requests' tiles, which are disjoint, in `sample`, which it resizes.
  virtual void compute(std::span<const RenderRequest> requests, Sample& sample) const = 0;
};

}  // namespace esim
