#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace esim::inline scene {

/// A direction's place in the unit square: the octahedron |x| + |y| + |z| = 1, unfolded around its upper half
/// (Engelhardt, Dachsbacher, "Octahedron environment maps", VMV 2008). Any length except zero.
struct OctahedralPlace {
  float u, v;

  static OctahedralPlace of(float x, float y, float z) {
    const float scale = 1 / (std::fabs(x) + std::fabs(y) + std::fabs(z));
    const float p = x * scale, q = y * scale;
    const float p_lower = std::copysign(1 - std::fabs(q), p), q_lower = std::copysign(1 - std::fabs(p), q);
    return {0.5F + 0.5F * (z < 0 ? p_lower : p), 0.5F + 0.5F * (z < 0 ? q_lower : q)};
  }

  /// The unit vector at this place.
  Eigen::Vector3f direction() const {
    const float p = 2 * u - 1, q = 2 * v - 1, z = 1 - std::fabs(p) - std::fabs(q);
    const float x = z < 0 ? std::copysign(1 - std::fabs(q), p) : p, y = z < 0 ? std::copysign(1 - std::fabs(p), q) : q;
    return Eigen::Vector3f(x, y, z).normalized();
  }

  /// The solid angle per area of the square, relative to its mean times a constant: 1 / |p|³ of the point p on the
  /// octahedron.
  float solid_angle_weight() const {
    const float p = std::fabs(2 * u - 1), q = std::fabs(2 * v - 1), z = 1 - p - q;
    const float x = z < 0 ? 1 - q : p, y = z < 0 ? 1 - p : q;
    const float squared = x * x + y * y + z * z;
    return 1 / (squared * std::sqrt(squared));
  }
};

/// Where a map of size x size texels lies among values that several maps share. Texels are in rows, with one more
/// around the square that repeats the texel behind the fold, so that the bilinear interpolation between texel centres
/// is continuous everywhere on the sphere.
struct OctahedralLayout {
  int size = 0;
  std::size_t offset = 0;

  std::size_t row_length() const { return static_cast<std::size_t>(size) + 2; }
  std::size_t value_count() const { return row_length() * row_length(); }

  /// The interpolated value at a place; Value: float, or an Eigen array.
  template <typename Value>
  Value value(const Value* values, const OctahedralPlace& at) const {
    const auto count = static_cast<float>(size);
    // In the square, also for NaN.
    const float x = std::min(std::max(0.0F, at.u * count + 0.5F), count + 0.5F);
    const float y = std::min(std::max(0.0F, at.v * count + 0.5F), count + 0.5F);
    const int column = static_cast<int>(x), row = static_cast<int>(y);
    const float s = x - static_cast<float>(column), t = y - static_cast<float>(row);
    const Value* const upper = values + offset + static_cast<std::size_t>(row) * row_length() + column;
    const Value* const lower = upper + row_length();
    const Value above = upper[0] + s * (upper[1] - upper[0]), below = lower[0] + s * (lower[1] - lower[0]);
    return above + t * (below - above);
  }

  template <typename Value>
  Value& texel(Value* values, int column, int row) const {
    return values[offset + static_cast<std::size_t>(row + 1) * row_length() + static_cast<std::size_t>(column + 1)];
  }
  OctahedralPlace centre(int column, int row) const {
    const float per = 1 / static_cast<float>(size);
    return {(static_cast<float>(column) + 0.5F) * per, (static_cast<float>(row) + 0.5F) * per};
  }

  /// Fills the texels around the square from those in it.
  template <typename Value>
  void fold(Value* values) const {
    const auto outside = [&](int column, int row) {
      int from_column = column, from_row = row;
      if (column < 0 || column >= size) from_row = size - 1 - from_row, from_column = std::clamp(column, 0, size - 1);
      if (row < 0 || row >= size) from_column = size - 1 - from_column, from_row = std::clamp(from_row, 0, size - 1);
      texel(values, column, row) = texel(values, from_column, from_row);
    };
    for (int i = 0; i < size; ++i) outside(-1, i), outside(size, i), outside(i, -1), outside(i, size);
    for (const int column : {-1, size}) {
      for (const int row : {-1, size}) {
        // All corners of the square are the same direction, -z.
        texel(values, column, row) = texel(values, column < 0 ? size - 1 : 0, row < 0 ? size - 1 : 0);
      }
    }
  }
};

}  // namespace esim::inline scene
