#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <vector>

#include "esim/scene/deformation/vertex_frames.h"

namespace esim::inline scene {

/// The cubic splines through the positions of vertices at the times of their frames: twice continuously differentiable,
/// without knots at the second and at the second last time ("not a knot"; de Boor, "A Practical Guide to Splines",
/// chapters IV and IX). Three frames are joined by a parabola, two by a line. Polynomials in time up to degree 3 are
/// reproduced.
///
/// They are kept as control points of B-splines, as many as there are frames, which replace the frames in memory. At
/// every time, a position is a weighted mean of at most four control points, with weights from 0 to 1.
class VertexSpline {
 public:
  static constexpr std::size_t kMaxDegree = 3;

  /// Throws UserError "REASON" if a control point is not finite, or farther than 1e12 from the origin, as between times
  /// of very unequal steps.
  explicit VertexSpline(VertexFrames frames);

  double start_s() const { return knots_.front(); }
  double end_s() const { return knots_.back(); }
  std::size_t degree() const { return degree_; }

  /// Number of control points of a vertex.
  std::size_t size() const { return size_; }

  /// One control point of each vertex.
  const Eigen::Vector3f* control_points(std::size_t index) const { return control_points_.data() + index * vertices_; }
  std::size_t vertices() const { return vertices_; }

  /// The control points c[first] to c[first + degree()] at a time, and factors of their differences: the position is
  /// c[first] + sum_j steps[j] (c[first + j + 1] - c[first + j]), the velocity per second the same sum with the slopes.
  struct Place {
    std::size_t first = 0;
    std::array<float, kMaxDegree> steps{}, slopes{};
  };

  /// The place of a time, which is limited to the times of the frames.
  Place place_at(double t_s) const;

 private:
  struct Basis {
    std::size_t first = 0;
    std::array<double, kMaxDegree + 1> values{};
    std::array<double, kMaxDegree> slopes{};  // of the differences
  };

  Basis basis_at(double t_s) const;
  void interpolate(const std::vector<double>& times_s);

  std::size_t vertices_, size_, degree_;
  std::vector<double> knots_;  // size_ + degree_ + 1
  std::vector<Eigen::Vector3f> control_points_;
};

}  // namespace esim::inline scene
