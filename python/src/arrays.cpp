#include "arrays.h"

#include <algorithm>
#include <cstddef>

namespace esim::python {
namespace {

// The layouts, which _types.py repeats.
static_assert(sizeof(Event) == 16 && offsetof(Event, t) == 0 && offsetof(Event, x) == 8 && offsetof(Event, y) == 10 &&
              offsetof(Event, polarity) == 12);
static_assert(sizeof(State) == 8 * 20 && sizeof(ImuSample) == 8 * 13);

void copy(const Eigen::Vector3d& from, double* to) { std::copy_n(from.data(), 3, to); }

}  // namespace

State to_state(TimeNs t, const Kinematics& kinematics) {
  State state;
  state.t = t;
  copy(kinematics.T_world_body.translation, state.position);
  std::copy_n(kinematics.T_world_body.rotation.coeffs().data(), 4, state.orientation);
  copy(kinematics.velocity_world, state.velocity);
  copy(kinematics.acceleration_world, state.acceleration);
  copy(kinematics.omega_body, state.angular_velocity);
  copy(kinematics.alpha_body, state.angular_acceleration);
  return state;
}

ImuSample to_imu_sample(TimeNs t, const InertialSignals& measured, const InertialSignals& bias) {
  ImuSample sample;
  sample.t = t;
  copy(measured.angular_rate, sample.angular_rate);
  copy(measured.specific_force, sample.specific_force);
  copy(bias.angular_rate, sample.angular_rate_bias);
  copy(bias.specific_force, sample.specific_force_bias);
  return sample;
}

void append_matrix(const SE3& pose, std::vector<double>& out) {
  const Eigen::Matrix<double, 4, 4, Eigen::RowMajor> matrix = pose.matrix();
  out.insert(out.end(), matrix.data(), matrix.data() + matrix.size());
}

}  // namespace esim::python
