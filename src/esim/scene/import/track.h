#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

namespace esim::inline scene {

enum class Interpolation { step, linear, cubic };

/// A property of a node over time: translation or scale (x y z and an unused number), or rotation (x y z w).
struct Track {
  Interpolation interpolation = Interpolation::linear;
  std::vector<double> times_s;          ///< increasing; empty: the property does not change
  std::vector<Eigen::Vector4d> values;  ///< one per time; if cubic, three: slope before, value, slope after
};

/// The weights of a mesh's morph targets over time.
struct WeightTrack {
  Interpolation interpolation = Interpolation::linear;
  std::vector<double> times_s;  ///< as in Track
  std::vector<float> values;    ///< as in Track, each of as many numbers as there are targets
};

/// A property at one time, and its time derivative per second, which at a key is that of the interval after it.
struct TrackSample {
  Eigen::Vector4d value = Eigen::Vector4d::Zero(), slope = Eigen::Vector4d::Zero();
};

/// The track's value, which is constant before its first and after its last time. Rotations have unit norm. Between
/// linear keys they turn at a constant rate along the shorter path ("slerp", glTF 2.0, appendix C.3).
TrackSample sample_at(const Track& track, double t_s, bool is_rotation);

/// The track must not be empty.
inline Eigen::Vector4d value_at(const Track& track, double t_s, bool is_rotation) {
  return sample_at(track, t_s, is_rotation).value;
}

/// The weights of `count` targets and their time derivatives per second.
void sample_at(const WeightTrack& track, double t_s, std::size_t count, std::vector<float>& weights,
               std::vector<float>& slopes);

/// Whether any of the track's values differ.
bool varies(const Track& track);
bool varies(const WeightTrack& track, std::size_t count);

}  // namespace esim::inline scene
