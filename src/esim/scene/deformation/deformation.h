#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <vector>

#include "esim/core/time.h"

namespace esim::inline scene {

/// The vertices of a deforming mesh at one time, in the order of Mesh::vertices, in the frame of its object.
struct DeformedVertices {
  std::vector<Eigen::Vector3f> positions;   ///< m
  std::vector<Eigen::Vector3f> normals;     ///< as Mesh::normals
  std::vector<Eigen::Vector3f> velocities;  ///< time derivative of the positions, m/s
};

/// How the vertices of a mesh move over time in the frame of their object: a pure function of time, which any number
/// of threads may evaluate.
class Deformation {
 public:
  virtual ~Deformation() = default;

  /// The time in which the mesh deforms. It keeps its first shape before, and its last shape after that.
  virtual TimeSpan span() const = 0;

  /// Computes the vertices at `t`, and resizes the lists.
  virtual void evaluate(TimeNs t, DeformedVertices& vertices) const = 0;

  /// A box that contains all vertices at `t`. An estimate may be larger than the smallest box, but never smaller.
  virtual Eigen::AlignedBox3f bounds(TimeNs t) const;
};

}  // namespace esim::inline scene
