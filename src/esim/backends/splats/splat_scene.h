#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <vector>

#include "esim/backends/splats/splat_renderer.h"

// Private to backends/splats.
namespace esim::inline backends::inline splats {

/// Neighbouring splats of similar size, which are culled and projected together.
struct SplatCluster {
  static constexpr std::size_t kMost = 128;

  std::uint32_t first, count;  ///< of SplatGroup's arrays; both are multiples of 8
};

/// The splats of an object, in clusters. Arrays have an entry per splat; the ends of clusters are filled with splats of
/// opacity 0.
struct SplatGroup {
  using Column = std::vector<float>;

  explicit SplatGroup(const Splats& splats);

  std::vector<SplatCluster> clusters;

  /// Per cluster: the box around the centres (its middle and half of its sides), and the largest standard deviation; m.
  std::array<Column, 3> box_middle, box_half;
  Column largest_deviation;

  std::array<Column, 3> centre;               ///< m
  std::array<std::array<Column, 3>, 3> axes;  ///< axes[i][k]: component k of the standard deviation along axis i, m
  Column opacity;
  std::array<Column, 3> colour;  ///< the constant part: 0.5 + Y_0 harmonics_0

  int degree = 0;
  std::vector<std::uint16_t> harmonics;  ///< half floats: [coefficient - 1][colour][splat]
  std::size_t size = 0;                  ///< of each array
  SplatFilter filter = SplatFilter::dilated;

  const std::uint16_t* harmonic(std::size_t coefficient, std::size_t colour_index) const {
    return harmonics.data() + ((coefficient - 1) * 3 + colour_index) * size;
  }
};

class SplatScene {
 public:
  explicit SplatScene(const std::vector<SplatObject>& objects);

  struct Placed {
    SplatGroup group;
    std::size_t object = 0;  ///< 0: static; i + 1: the i-th moving object of requests
    Eigen::Quaterniond to_object{};
  };
  std::vector<Placed> groups;
  SplatLight light = SplatLight::display;
};

}  // namespace esim::inline backends::inline splats
