#include "esim/record/formats/rig_yaml.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <vector>

namespace esim {
namespace {

/// The original's name for a distortion, and its parameters.
struct RigDistortion {
  const char* type;
  std::vector<double> parameters;
};

RigDistortion named(const NoDistortion&) { return {"none", {}}; }
RigDistortion named(const RadialTangential& d) {
  if (d.k3 == 0) return {"radial-tangential", {d.k1, d.k2, d.p1, d.p2}};
  return {"radial-tangential", {d.k1, d.k2, d.p1, d.p2, d.k3}};
}
RigDistortion named(const Equidistant& d) { return {"equidistant", {d.k1, d.k2, d.k3, d.k4}}; }
RigDistortion named(const Fov& d) { return {"fov", {d.w}}; }

std::string matrix(int indent, const char* key, int rows, int columns, const std::vector<double>& values) {
  return fmt::format("{0:{1}}{2}:\n{0:{1}}  cols: {3}\n{0:{1}}  rows: {4}\n{0:{1}}  data: [{5}]\n", "", indent, key,
                     columns, rows, fmt::join(values, ", "));
}

}  // namespace

std::string rig_yaml(const RecordingInfo& info) {
  std::string text = "label: \"esim\"\ncameras:\n";
  for (const auto& [name, model, T_body_camera] : info.cameras) {
    const auto [type, parameters] = std::visit([](const auto& kind) { return named(kind); }, model.distortion);
    text += fmt::format("- camera:\n    label: {}\n    line-delay-nanoseconds: 0\n", name);
    text += fmt::format("    image_height: {}\n    image_width: {}\n    type: pinhole\n", model.height, model.width);
    text += matrix(4, "intrinsics", 4, 1, {model.fx, model.fy, model.cx, model.cy});
    text += fmt::format("    distortion:\n      type: {}\n", type);
    text += matrix(6, "parameters", static_cast<int>(parameters.size()), 1, parameters);
    const Eigen::Matrix<double, 4, 4, Eigen::RowMajor> m = T_body_camera.matrix().array() + 0.0;  // no negative zeros
    text += matrix(2, "T_B_C", 4, 4, std::vector<double>(m.data(), m.data() + m.size()));
  }
  return text;
}

}  // namespace esim
