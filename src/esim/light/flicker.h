#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <utility>
#include <vector>

#include "esim/core/image.h"
#include "esim/core/parallel.h"
#include "esim/light/scene_light.h"
#include "esim/render/sample.h"

namespace esim::inline light {

/// The light of a segment, by which its irradiance is to be multiplied.
struct SegmentLight {
  const SceneLight* scene = nullptr;
  // The objects that the pixels see at t0 and t1, as in Sample::object; only if objects are lights.
  ImageView<std::uint16_t> before{}, after{};
};

/// The flicker of the light in front of one camera. Samplers see the scene in constant light; this stage between the
/// sampler and the event camera divides their segments at the nodes of the modulation and multiplies their irradiance
/// by it, so that the events do not depend on the sampling. docs/methods/light.md gives the equations.
class Flicker {
 public:
  /// Renders which object each pixel of a tile sees at t.
  using RenderObjects = std::function<void(TimeNs t, const Tile& tile, Sample& sample)>;
  /// Takes divided segments, valid during the call. No further segment begins before the watermark.
  using Take = std::function<void(std::span<const Segment> segments, TimeNs watermark)>;

  /// `dark`: what the event camera adds to the irradiance before the logarithm.
  Flicker(SceneLight light, double dark) : light_(std::move(light)), dark_(static_cast<float>(dark)) {}

  /// The modulation of the light, at any time.
  const SceneLight& light() const { return light_; }
  /// What the event camera adds to the irradiance before the logarithm.
  double dark() const { return static_cast<double>(dark_); }

  /// Takes the next segments of a sampler, for the functions below. If objects are lights, renders which of them the
  /// pixels see at the segments' ends.
  void look(std::span<const Segment> segments, int width, int height, const RenderObjects& render);

  /// The light of the i-th of these segments. Valid until the next look().
  SegmentLight light_of(std::size_t i) const { return {&light_, ends_[i].before, ends_[i].after}; }

  /// Divides these segments for an event camera, a few at a time. `watermark` is that of the sampler after them.
  void divide(TimeNs watermark, const Workers& workers, const Take& take);

  /// Multiplies an image at t by its light. `object`: as in Sample; read only if objects are lights.
  void illuminate(TimeNs t, const Image<std::uint16_t>& object, Image<float>& irradiance) const;

  /// The state between two samples, for core/state_archive.h.
  template <class Archive, class Self>
  static void transfer(Archive& archive, Self& self) {
    archive.sized_image(self.last_objects_);
    archive.objects(self.objects_, [](auto& a, auto& at_end) {
      a.value(at_end.first);
      a.sized_image(at_end.second);
    });
  }

 private:
  /// What the pixels of a segment see at its ends.
  struct Ends {
    ImageView<std::uint16_t> before, after;
    std::vector<std::size_t> lights;  // that any of them sees
  };
  /// A segment's irradiance at one time.
  struct Plate {
    std::size_t segment, pixels;  // the first of its pixels in memory_
    TimeNs t;
  };

  void add_plate(std::size_t segment, TimeNs t);
  void fill(std::size_t plate, int row);
  void pass_on(TimeNs watermark, const Workers& workers, const Take& take);
  TimeNs next_node(std::size_t segment, TimeNs t) const;
  std::vector<std::size_t> lights_of(const Tile& tile, const Ends& ends) const;
  void keep_objects();

  SceneLight light_;
  float dark_;
  std::span<const Segment> segments_;
  std::vector<Ends> ends_;
  std::vector<std::pair<Tile, Image<std::uint16_t>>> objects_;  // at the segments' ends
  Image<std::uint16_t> last_objects_;                           // at the end of each tile's last segment
  Sample sample_;

  // The divided segments that are passed on next: from one plate to the next of the same segment.
  std::vector<Plate> plates_;
  std::vector<float> factors_;  // of each light at each plate
  std::vector<float> memory_;
  std::vector<Segment> divided_;
};

}  // namespace esim::inline light
