#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <vector>

#include "esim/backends/splats/splat_clusters.h"
#include "esim/backends/splats/splat_renderer.h"

// Private to backends/splats.
namespace esim::inline backends::inline splats {

/// The place of a cluster's splats in the arrays of a SplatGroup; multiples of 8.
struct SplatRange {
  std::uint32_t first, count;
};

/// The splats of an object, in clusters that are culled and projected together. Arrays have an entry per splat; the
/// ends of clusters are filled with splats of opacity 0.
struct SplatGroup {
  using Column = std::vector<float>;

  SplatGroup() = default;
  SplatGroup(const Splats& splats, const SplatClusters& clusters);

  std::vector<SplatRange> clusters;

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

 private:
  void set(std::size_t at, const Splats& splats, std::size_t from, float its_opacity);
};

class SplatScene {
 public:
  explicit SplatScene(const std::vector<SplatObject>& objects);

  struct Placed {
    SplatGroup fine;
    SplatGroup merged;       ///< the same clusters of fewer splats, for clusters that are far away
    std::size_t object = 0;  ///< 0: static; i + 1: the i-th moving object of requests
    Eigen::Quaterniond to_object{};
  };
  std::vector<Placed> groups;
  SplatLight light = SplatLight::display;
};

}  // namespace esim::inline backends::inline splats
