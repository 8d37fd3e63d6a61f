#include "simulation/trajectory.h"

#include <nanobind/stl/array.h>
#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <optional>
#include <utility>

#include "arrays.h"
#include "bindings.h"
#include "esim/core/error.h"
#include "esim/motion/trajectory_file.h"

namespace esim::python {
namespace {

using Times = nb::ndarray<const std::int64_t, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using Matrices = nb::ndarray<const double, nb::shape<-1, 4, 4>, nb::c_contig, nb::device::cpu>;

/// A pose in a pickle.
struct FlatPose {
  TimeNs t = 0;
  double orientation[4]{}, position[3]{};  // x y z w; m
};

/// A motion through poses.
SharedTrajectory fit(std::vector<TimedPose> poses, const FitOptions& options) {
  const nb::gil_scoped_release released;
  const FittedTrajectory fitted = fit_trajectory(poses, options);
  return {std::make_shared<const SplineTrajectory>(fitted.trajectory), fitted.report,
          std::make_shared<const std::vector<TimedPose>>(std::move(poses)), options};
}

SharedTrajectory from_matrices(const Times& times, const Matrices& matrices, int order, double knot_interval_s,
                               double smoothing_time_s) {
  std::vector<TimedPose> poses(times.size());
  for (std::size_t i = 0; i < poses.size(); ++i) {
    try {
      poses[i] = {times.data()[i], pose_in(matrices.data() + 16 * i)};
    } catch (const UserError& error) {
      throw UserError("pose " + std::to_string(i) + ": " + error.what());
    }
  }
  return fit(std::move(poses), {order, knot_interval_s, smoothing_time_s});
}

SharedTrajectory from_file(const std::filesystem::path& path, std::optional<double> rate_hz, double scale,
                           std::optional<std::array<double, 3>> up, int order, double knot_interval_s,
                           double smoothing_time_s) {
  TrajectoryFileOptions options{rate_hz, scale};
  if (up) options.up.emplace((*up)[0], (*up)[1], (*up)[2]);
  check_options(options);
  try {
    return fit(read_trajectory_file(path, options).poses, {order, knot_interval_s, smoothing_time_s});
  } catch (const UserError& error) {
    const std::string message = error.what();
    throw UserError(message.starts_with(path.string()) ? message : path.string() + ": " + message);
  }
}

/// The exact poses, so that from_state() fits the same motion.
nb::tuple state(const SharedTrajectory& self) {
  std::vector<FlatPose> poses(self.poses->size());
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const auto& [t, pose] = (*self.poses)[i];
    poses[i].t = t;
    std::copy_n(pose.rotation.coeffs().data(), 4, poses[i].orientation);
    std::copy_n(pose.translation.data(), 3, poses[i].position);
  }
  return nb::make_tuple(bytes_to_numpy(std::move(poses)), self.options.order, self.options.knot_interval_s,
                        self.options.smoothing_time_s);
}

SharedTrajectory from_state(const Bytes& bytes, int order, double knot_interval_s, double smoothing_time_s) {
  std::vector<TimedPose> poses(bytes.size() / sizeof(FlatPose));
  for (std::size_t i = 0; i < poses.size(); ++i) {
    FlatPose flat;
    std::memcpy(static_cast<void*>(&flat), bytes.data() + i * sizeof(FlatPose), sizeof(FlatPose));
    poses[i].t = flat.t;
    std::copy_n(flat.orientation, 4, poses[i].T_world_body.rotation.coeffs().data());
    std::copy_n(flat.position, 3, poses[i].T_world_body.translation.data());
  }
  return fit(std::move(poses), {order, knot_interval_s, smoothing_time_s});
}

nb::object states(const SharedTrajectory& self, const Times& times) {
  std::vector<State> states;
  states.reserve(times.size());
  for (std::size_t i = 0; i < times.size(); ++i) {
    const TimeNs t = times.data()[i];
    if (t < self.motion->start() || t > self.motion->end()) {
      throw UserError("t = " + std::to_string(t) + " ns is outside the trajectory, from " +
                      std::to_string(self.motion->start()) + " to " + std::to_string(self.motion->end()) + " ns");
    }
    states.push_back(to_state(t, self.motion->at(t)));
  }
  return bytes_to_numpy(std::move(states));
}

nb::dict report(const SharedTrajectory& self) {
  nb::dict report;
  report["rms_position_m"] = self.fit.rms_position_m;
  report["max_position_m"] = self.fit.max_position_m;
  report["rms_rotation_rad"] = self.fit.rms_rotation_rad;
  report["max_rotation_rad"] = self.fit.max_rotation_rad;
  report["knot_interval_s"] = self.fit.knot_interval_s;
  report["smoothing_time_s"] = self.fit.smoothing_time_s;
  report["control_points"] = self.fit.control_points;
  return report;
}

}  // namespace

void bind_trajectory(nb::module_& module) {
  nb::class_<SharedTrajectory>(module, "Trajectory")
      .def_static("from_matrices", &from_matrices, nb::arg("times"), nb::arg("matrices"), nb::arg("order"),
                  nb::arg("knot_interval_s"), nb::arg("smoothing_time_s"))
      .def_static("from_file", &from_file, nb::arg("path"), nb::arg("rate_hz").none(), nb::arg("scale"),
                  nb::arg("up").none(), nb::arg("order"), nb::arg("knot_interval_s"), nb::arg("smoothing_time_s"))
      .def_static("from_state", &from_state, nb::arg("poses"), nb::arg("order"), nb::arg("knot_interval_s"),
                  nb::arg("smoothing_time_s"))
      .def("state", &state)
      .def("states", &states, nb::arg("times"))
      .def("fit_report", &report)
      .def_prop_ro("start", [](const SharedTrajectory& self) { return self.motion->start(); })
      .def_prop_ro("end", [](const SharedTrajectory& self) { return self.motion->end(); });
}

}  // namespace esim::python
