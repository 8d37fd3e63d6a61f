#pragma once

#include <string>
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
      objects{};  ///< pose T_world_object and twist of each moving object at t, in the scene's order
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

/// Evaluates a scene as one camera sees it. A renderer is made for one camera and one scene, keeps no history, and
/// never chooses a time: the same request gives the same sample, whatever was asked before and with any number of
/// threads, and a tile's pixels are the same as in the whole frame.
class Renderer {
 public:
  virtual ~Renderer() = default;

  virtual RendererTraits traits() const = 0;

  /// Fills E, Z and V of the request's tiles in `sample`, which is resized to the camera's image. The request names as
  /// many objects as move in the scene.
  virtual void render(const RenderRequest& request, Sample& sample) = 0;
};

}  // namespace esim
