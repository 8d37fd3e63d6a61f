// glTF with the extension KHR_gaussian_splatting, as in its release candidate of 2026, and as in earlier drafts.
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>
#include <vector>

#include "esim/scene/import/gltf/gltf_document.h"
#include "esim/scene/splats/harmonics.h"
#include "esim/scene/splats/splat_list.h"
#include "esim/scene/splats/splat_readers.h"

namespace esim::inline scene {
namespace {

using Json = GltfDocument::Json;

constexpr const char* kExtension = "KHR_gaussian_splatting";

const Json* splat_extension(const Json& primitive) {
  const Json* const extensions = GltfDocument::find(primitive, "extensions");
  return extensions != nullptr ? GltfDocument::find(*extensions, kExtension) : nullptr;
}

/// A primitive with splats, and where it is; several nodes may show the same one.
struct Placed {
  const Json* primitive = nullptr;
  Eigen::Affine3d T_scene_node;
};

/// A transform as a uniform scale and an orthogonal matrix, which may mirror.
struct Similarity {
  double scale = 1;
  Eigen::Matrix3d rotation;
  Eigen::Vector3d translation;
};

class SplatGltfReader {
 public:
  explicit SplatGltfReader(const std::filesystem::path& file) : file_(file), document_(file) {}

  Splats read(const WarningHandler& warn) {
    place_primitives();
    if (placed_.empty()) {
      if (!document_.list("meshes").empty()) fail_triangles(file_);
      document_.fail("contains no Gaussian splats");
    }
    if (!document_.list("animations").empty())
      warn(fmt::format("splats {}: animations are not supported, and are ignored", file_.string()));
    std::uint64_t count = 0;
    int degree = 0;
    for (const Placed& each : placed_) {
      count += document_.element_count(document_.index(attributes(*each.primitive), "POSITION", "accessors"));
      degree = std::max(degree, degree_of(*each.primitive));
    }
    SplatList list(file_, degree, count, document_.bytes());
    list.set_light(light());
    for (const Placed& each : placed_) append(each, list);
    return list.finish(warn);
  }

 private:
  const Json& attributes(const Json& primitive) const {
    const Json* const attributes = GltfDocument::find(primitive, "attributes");
    if (attributes == nullptr) document_.fail("is damaged: splats must have attributes");
    return *attributes;
  }

  /// The name of an attribute; drafts of the extension named some of them differently.
  std::optional<std::string> attribute(const Json& primitive, const std::string& name) const {
    for (const char* const prefix : {"KHR_gaussian_splatting:", "_"}) {
      if (GltfDocument::find(attributes(primitive), (prefix + name).c_str()) != nullptr) return prefix + name;
    }
    return std::nullopt;
  }

  static std::string harmonic(int degree, int index) { return fmt::format("SH_DEGREE_{}_COEF_{}", degree, index); }

  int degree_of(const Json& primitive) const {
    int degree = 0;
    while (degree < kMaxSplatDegree && attribute(primitive, harmonic(degree + 1, 0))) ++degree;
    return degree;
  }

  /// Numbers of each splat, which need not be finite.
  std::vector<float> numbers(const Json& primitive, const std::string& name, std::size_t components) const {
    const std::string full = name == "POSITION" ? name : attribute(primitive, name).value_or("");
    if (full.empty())
      document_.fail(fmt::format("is damaged: the attribute {}:{} of splats is missing", kExtension, name));
    return document_.unchecked_floats(document_.index(attributes(primitive), full.c_str(), "accessors"), components);
  }

  /// Checks what the extension says of all splats of a primitive.
  void check(const Json& extension) const {
    const std::string kernel = document_.text(extension, "kernel", "ellipse");
    if (kernel != "ellipse") document_.fail(fmt::format("kernel of splats must be ellipse, not {}", kernel));
    const Json* const extensions = GltfDocument::find(extension, "extensions");
    if (extensions != nullptr && extensions->is_object() && !extensions->empty())
      document_.fail(fmt::format("its splats use the extension {}, which is not supported; export it without that",
                                 extensions->begin().key()));
  }

  SplatLight light() const {
    bool first = true;
    std::string space;
    for (const Placed& each : placed_) {
      const Json& extension = *splat_extension(*each.primitive);
      const std::string own = document_.text(extension, "colorSpace", "srgb_rec709_display");
      if (own != "srgb_rec709_display" && own != "lin_rec709_display")
        document_.fail(fmt::format("colorSpace must be srgb_rec709_display or lin_rec709_display, not {}", own));
      if (!std::exchange(first, false) && own != space)
        document_.fail("all of its splats must have the same colorSpace; export them as separate files");
      space = own;
    }
    return space == "lin_rec709_display" ? SplatLight::linear : SplatLight::display;
  }

  Similarity similarity(const Eigen::Affine3d& transform) const {
    const Eigen::Matrix3d linear = transform.linear();
    const double scale = std::cbrt(std::abs(linear.determinant()));
    constexpr double kTolerance = 1e-3;  // of the scale
    if (!(scale > 0) || !std::isfinite(scale) ||
        !((linear.transpose() * linear / (scale * scale) - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() <
          2 * kTolerance))
      document_.fail("the scale of a node with splats must be uniform and not zero; apply the scale in its editor");
    return {scale, linear / scale, transform.translation()};
  }

  void append(const Placed& placed, SplatList& list) const {
    const Json& primitive = *placed.primitive;
    check(*splat_extension(primitive));
    const Similarity to_scene = similarity(placed.T_scene_node);
    const auto positions = numbers(primitive, "POSITION", 3), rotations = numbers(primitive, "ROTATION", 4),
               scales = numbers(primitive, "SCALE", 3);
    std::vector<float> opacities;
    std::vector<std::vector<float>> harmonics;  // per coefficient
    if (attribute(primitive, "OPACITY") && attribute(primitive, harmonic(0, 0))) {
      opacities = numbers(primitive, "OPACITY", 1);
      for (int l = 0; l <= degree_of(primitive); ++l) {
        for (int n = 0; n < 2 * l + 1; ++n) harmonics.push_back(numbers(primitive, harmonic(l, n), 3));
      }
    } else {
      read_draft_colours(primitive, opacities, harmonics);
    }
    const std::size_t count = opacities.size();
    bool same = positions.size() == 3 * count && rotations.size() == 4 * count && scales.size() == 3 * count;
    for (const std::vector<float>& each : harmonics) same = same && each.size() == 3 * count;
    if (!same) document_.fail("is damaged: all attributes of splats must have the same count");

    // Standard deviations. In the review draft of 2025, they were logarithms, most of which are negative.
    const auto negative = std::count_if(scales.begin(), scales.end(), [](float scale) { return scale < 0; });
    const bool logarithms = 2 * static_cast<std::size_t>(negative) > scales.size();

    // A splat looks the same if it is mirrored at its centre, so that a mirrored rotation may be negated.
    const double sign = to_scene.rotation.determinant() < 0 ? -1 : 1;
    const Eigen::Matrix3d proper = sign * to_scene.rotation;
    const Eigen::Quaternionf turn = Eigen::Quaterniond(proper).normalized().cast<float>();
    const HarmonicRotation harmonic_turn(to_scene.rotation);
    for (std::size_t i = 0; i < count; ++i) {
      const Eigen::Map<const Eigen::Vector3f> position(&positions[3 * i]), scale(&scales[3 * i]);
      const Eigen::Map<const Eigen::Vector4f> rotation(&rotations[4 * i]);
      Splat splat;
      splat.position =
          (to_scene.scale * (to_scene.rotation * position.cast<double>()) + to_scene.translation).cast<float>();
      splat.deviation = scale;
      if (logarithms) splat.deviation = scale.array().exp();
      splat.deviation *= static_cast<float>(to_scene.scale);
      splat.rotation = (turn * Eigen::Quaternionf(rotation)).coeffs();
      splat.opacity = opacities[i];
      for (std::size_t k = 0; k < harmonics.size(); ++k) std::copy_n(&harmonics[k][3 * i], 3, &splat.harmonics[3 * k]);
      harmonic_turn.apply(splat, list.coefficients());
      list.add(splat);
    }
  }

  /// Of the first drafts, in which COLOR_0 has the colour, which is the same in all directions, and the opacity.
  void read_draft_colours(const Json& primitive, std::vector<float>& opacities,
                          std::vector<std::vector<float>>& harmonics) const {
    if (GltfDocument::find(attributes(primitive), "COLOR_0") == nullptr || attribute(primitive, "OPACITY"))
      document_.fail(
          fmt::format("is damaged: the attributes {0}:OPACITY and {0}:SH_DEGREE_0_COEF_0 must be given", kExtension));
    const std::vector<float> colours =
        document_.unchecked_floats(document_.index(attributes(primitive), "COLOR_0", "accessors"), 4);
    std::vector<float>& first = harmonics.emplace_back();
    for (std::size_t i = 0; i + 4 <= colours.size(); i += 4) {
      for (std::size_t c = 0; c < 3; ++c) first.push_back(harmonic_of_colour(colours[i + c]));
      opacities.push_back(colours[i + 3]);
    }
  }

  Eigen::Affine3d transform(const Json& node) const {
    Eigen::Affine3d result = Eigen::Affine3d::Identity();
    if (GltfDocument::find(node, "matrix") != nullptr) {
      const auto columns = document_.numbers(node, "matrix", std::vector<double>(16));
      result.matrix() = Eigen::Map<const Eigen::Matrix4d>(columns.data());
      if (result.matrix().row(3) != Eigen::RowVector4d::UnitW())
        document_.fail("is damaged: the matrix of a node is not affine");
      return result;
    }
    const auto t = document_.numbers(node, "translation", {0, 0, 0}), s = document_.numbers(node, "scale", {1, 1, 1});
    const auto r = document_.numbers(node, "rotation", {0, 0, 0, 1});
    Eigen::Quaterniond rotation(r[3], r[0], r[1], r[2]);
    if (!(rotation.norm() > 1e-6)) document_.fail("is damaged: a node's rotation is zero");
    result.translation() = Eigen::Vector3d(t[0], t[1], t[2]);
    result.linear() = rotation.normalized().toRotationMatrix() * Eigen::Vector3d(s[0], s[1], s[2]).asDiagonal();
    return result;
  }

  /// Finds the splats of the default scene, and where they are in it.
  void place_primitives() {
    const Json& nodes = document_.list("nodes");
    const Json& scenes = document_.list("scenes");
    if (scenes.empty()) return;
    std::vector<bool> visited(nodes.size());
    std::vector<std::pair<std::size_t, Eigen::Affine3d>> to_visit;
    const auto visit_later = [&](const Json* indices, const Eigen::Affine3d& parent) {
      if (indices == nullptr || !indices->is_array()) return;
      for (auto child = indices->rbegin(); child != indices->rend(); ++child) {
        if (!child->is_number_unsigned() || child->get<std::uint64_t>() >= nodes.size())
          document_.fail("is damaged: it refers to a missing node");
        to_visit.emplace_back(child->get<std::size_t>(), parent);
      }
    };
    const Eigen::Affine3d z_up(Eigen::AngleAxisd(std::numbers::pi / 2, Eigen::Vector3d::UnitX()));  // glTF: y is up
    visit_later(GltfDocument::find(scenes[document_.first_scene()], "nodes"), z_up);
    while (!to_visit.empty()) {
      const auto [index, parent] = to_visit.back();
      to_visit.pop_back();
      if (visited[index]) document_.fail("is damaged: a node has two parents");
      visited[index] = true;
      const Json& node = nodes[index];
      const Eigen::Affine3d placed = parent * transform(node);
      if (document_.has_index(node, "mesh"))
        place(document_.list("meshes")[document_.index(node, "mesh", "meshes")], placed);
      visit_later(GltfDocument::find(node, "children"), placed);
    }
  }

  void place(const Json& mesh, const Eigen::Affine3d& transform) {
    const Json* const primitives = GltfDocument::find(mesh, "primitives");
    if (primitives == nullptr || !primitives->is_array()) return;
    for (const Json& primitive : *primitives) {
      if (splat_extension(primitive) != nullptr) placed_.push_back({&primitive, transform});
    }
  }

  std::filesystem::path file_;
  GltfDocument document_;
  std::vector<Placed> placed_;
};

}  // namespace

Splats read_splat_gltf(const std::filesystem::path& file, const WarningHandler& warn) {
  return SplatGltfReader(file).read(warn);
}

}  // namespace esim::inline scene
