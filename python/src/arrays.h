#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include <cstdint>
#include <cstring>
#include <initializer_list>
#include <utility>
#include <vector>

#include "esim/events/event.h"
#include "esim/geometry/kinematics.h"
#include "esim/geometry/se3.h"

namespace esim::python {

namespace nb = nanobind;

/// A NumPy array that owns the vector's memory.
template <typename T>
nb::object to_numpy(std::vector<T> values, std::initializer_list<std::size_t> shape) {
  auto* const kept = new std::vector<T>(std::move(values));
  const nb::capsule owner(kept, [](void* memory) noexcept { delete static_cast<std::vector<T>*>(memory); });
  return nb::cast(nb::ndarray<nb::numpy, T>(kept->data(), shape, owner));
}

template <typename T>
nb::object to_numpy(std::vector<T> values) {
  const std::size_t count = values.size();
  return to_numpy(std::move(values), {count});
}

/// The bytes of records, without a copy; Python views them with the layouts of _types.py.
template <typename Record>
nb::object bytes_to_numpy(std::vector<Record> records) {
  auto* const kept = new std::vector<Record>(std::move(records));
  const nb::capsule owner(kept, [](void* memory) noexcept { delete static_cast<std::vector<Record>*>(memory); });
  return nb::cast(nb::ndarray<nb::numpy, std::uint8_t>(reinterpret_cast<std::uint8_t*>(kept->data()),
                                                       {kept->size() * sizeof(Record)}, owner));
}

using Bytes = nb::ndarray<const std::uint8_t, nb::ndim<1>, nb::c_contig, nb::device::cpu>;

/// Events in the memory of an array, which is aligned.
inline EventSpan events_in(const Bytes& bytes) {
  return {reinterpret_cast<const Event*>(bytes.data()), bytes.size() / sizeof(Event)};
}

/// The motion of a body at one instant, as Python sees it.
struct State {
  TimeNs t = 0;
  double position[3]{}, orientation[4]{};  // m; x y z w
  double velocity[3]{}, acceleration[3]{};
  double angular_velocity[3]{}, angular_acceleration[3]{};
};

State to_state(TimeNs t, const Kinematics& kinematics);

/// A measurement of the IMU, as Python sees it.
struct ImuSample {
  TimeNs t = 0;
  double angular_rate[3]{}, specific_force[3]{};
  double angular_rate_bias[3]{}, specific_force_bias[3]{};
};

ImuSample to_imu_sample(TimeNs t, const InertialSignals& measured, const InertialSignals& bias);

/// The pose of a homogeneous matrix of 16 numbers, row by row. Throws UserError if it is not rigid.
inline SE3 pose_in(const double* matrix) {
  return SE3::from_matrix(Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(matrix));
}

/// A homogeneous matrix, row by row.
void append_matrix(const SE3& pose, std::vector<double>& out);

}  // namespace esim::python
