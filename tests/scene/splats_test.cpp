#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <fstream>
#include <limits>
#include <numbers>

#include "esim/core/error.h"
#include "esim/scene/splats/splat_file.h"
#include "glb_writer.h"
#include "splat_writer.h"
#include "support/errors.h"
#include "support/numeric.h"
#include "support/temporary_directory.h"
#include "support/test_data.h"

namespace esim {
namespace {

using test::GlbWriter;
using test::TemporaryDirectory;

constexpr float kC0 = 0.28209479F;

struct Loaded {
  Splats splats;
  std::vector<std::string> warnings;
};

Loaded load_with_warnings(const std::filesystem::path& path) {
  Loaded loaded;
  EXPECT_TRUE(is_splat_file(path)) << path;
  loaded.splats = load_splats(path, [&](const std::string& text) { loaded.warnings.push_back(text); });
  return loaded;
}

Splats load(const std::filesystem::path& path) {
  Loaded loaded = load_with_warnings(path);
  EXPECT_EQ(loaded.warnings, std::vector<std::string>());
  return std::move(loaded.splats);
}

Splats load(const std::string& name, const std::string& content) {
  const TemporaryDirectory folder;
  return load(folder.write(name, content));
}

/// The one-line error for a file.
std::string refusal(const std::filesystem::path& path) {
  const std::string message = test::message_of<UserError>([&] { load_splats(path, [](const std::string&) {}); });
  EXPECT_EQ(message.find('\n'), std::string::npos) << message;
  EXPECT_TRUE(test::contains(message, path.filename().string()));
  return message;
}

std::string refusal(const std::string& name, const std::string& content) {
  const TemporaryDirectory folder;
  return refusal(folder.write(name, content));
}

/// Replaces a text that occurs once.
std::string with(std::string text, const std::string& before, const std::string& after) {
  const std::size_t at = text.find(before);
  EXPECT_NE(at, std::string::npos) << before;
  return text.replace(at, before.size(), after);
}

testing::AssertionResult near(const Eigen::VectorXf& value, const Eigen::VectorXf& expected, float tolerance) {
  if (value.size() == expected.size() && (value - expected).cwiseAbs().maxCoeff() <= tolerance)
    return testing::AssertionSuccess();
  return testing::AssertionFailure() << value.transpose() << " is not " << expected.transpose();
}

/// The coefficient k of a colour of a splat.
float harmonic(const Splats& splats, std::size_t splat, std::size_t k, std::size_t colour) {
  return splats.harmonics.at((splat * splats.coefficients() + k) * 3 + colour);
}

void expect_test_coefficients(const Splats& splats, std::size_t first, const std::array<float, 16>& signs,
                              float tolerance = 0) {
  for (std::size_t k = first; k < splats.coefficients(); ++k) {
    for (std::size_t colour = 0; colour < 3; ++colour)
      EXPECT_NEAR(harmonic(splats, 0, k, colour),
                  signs[k] * test::test_coefficient(static_cast<int>(k), static_cast<int>(colour)), tolerance)
          << k << " " << colour;
  }
}

constexpr std::array<float, 16> kSame = {1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1};

void expect_plain(const Splats& splats, bool flat = false) {
  ASSERT_EQ(splats.size(), 1U);
  EXPECT_EQ(splats.positions[0], Eigen::Vector3f(1, 2, 3));
  EXPECT_TRUE(
      near(splats.deviations[0], Eigen::Vector3f(std::exp(-1.F), std::exp(-2.F), flat ? 0 : std::exp(-3.F)), 1e-6F));
  EXPECT_TRUE(near(splats.rotations[0], Eigen::Vector4f(0, 0, std::sqrt(0.5F), std::sqrt(0.5F)), 1e-6F));
  EXPECT_EQ(splats.opacities[0], 0.5F);
  expect_test_coefficients(splats, 0, kSame);
}

TEST(Splats, PlyOfEachDegree) {
  for (int degree = 0; degree <= 3; ++degree) {
    const Splats splats = load("a.ply", test::plain_ply(degree));
    EXPECT_EQ(splats.degree, degree);
    expect_plain(splats);
    EXPECT_EQ(splats.filter, SplatFilter::dilated);
    EXPECT_EQ(splats.light, SplatLight::display);
  }
}

TEST(Splats, PlyOfDegree4LosesTheHighest) {
  const TemporaryDirectory folder;
  const Loaded loaded = load_with_warnings(folder.write("a.ply", test::plain_ply(4)));
  ASSERT_EQ(loaded.warnings.size(), 1U);
  EXPECT_TRUE(test::contains(loaded.warnings[0], "degree 4"));
  EXPECT_EQ(loaded.splats.degree, 3);
  expect_plain(loaded.splats);
}

TEST(Splats, PlyCommentsSayHowTheModelWasTrained) {
  EXPECT_EQ(load("a.ply", test::plain_ply(0, "comment SplatRenderMode: mip\n")).filter, SplatFilter::mip);
  EXPECT_EQ(load("a.ply", test::plain_ply(0, "comment SplatRenderMode: default\n")).filter, SplatFilter::dilated);
  EXPECT_EQ(load("a.ply", test::plain_ply(0, "comment antialiased 1\n")).filter, SplatFilter::antialiased);
  EXPECT_EQ(load("a.ply", test::plain_ply(0, "comment antialiased 0\n")).filter, SplatFilter::dilated);
  EXPECT_EQ(load("a.ply", test::plain_ply(0, "comment esim_light linear\n")).light, SplatLight::linear);
}

TEST(Splats, PlyWithoutAThirdScaleIsFlat) {
  expect_plain(load("a.ply", with(test::plain_ply(1), "float scale_2", "float other")), true);
}

TEST(Splats, PlyOfOtherTypesAndEncodings) {
  const std::vector<std::pair<std::string, double>> properties = {
      {"x", 1},        {"y", 2},        {"z", 3},        {"f_dc_0", -0.75}, {"f_dc_1", -0.71875},
      {"rot_0", 2},    {"rot_1", 0},    {"rot_2", 0},    {"rot_3", 2},      {"f_dc_2", -0.6875},
      {"scale_0", -1}, {"scale_1", -2}, {"scale_2", -3}, {"opacity", 0}};
  const auto header = [&](const std::string& encoding) {
    std::string text = "ply\r\nformat " + encoding + " 1.0\r\ncomment x\r\nelement camera 2\r\nproperty short id\r\n";
    text += "element vertex 1\r\n";
    for (const auto& [name, value] : properties)
      text += "property " +
              std::string(name[0] == 'r'   ? "uchar "
                          : name[0] == 's' ? "int "
                                           : "double ") +
              name + "\r\n";
    return text + "element face 0\r\nproperty list uchar int vertex_indices\r\nend_header\r\n";
  };
  test::ByteWriter big, ascii;
  big.text(header("binary_big_endian")).put_reversed<short>(1).put_reversed<short>(2);
  ascii.text(header("ascii")).text("1\r\n2\r\n");
  for (const auto& [name, value] : properties) {
    if (name[0] == 'r') {
      big.put(static_cast<std::uint8_t>(value));
    } else if (name[0] == 's') {
      big.put_reversed(static_cast<std::int32_t>(value));
    } else {
      big.put_reversed(value);
    }
    ascii.text(std::to_string(value) + " ");
  }
  expect_plain(load("a.ply", big.bytes()));
  expect_plain(load("a.ply", ascii.bytes() + "\r\n"));
}

TEST(Splats, CompressedPly) {
  for (int degree = 0; degree <= 3; ++degree) {
    const Splats splats = load("a.ply", test::compressed_ply(degree));
    ASSERT_EQ(splats.size(), 2U);
    EXPECT_EQ(splats.degree, degree);
    for (std::size_t i = 0; i < 2; ++i) {
      const float sign = i == 0 ? -1 : 1;
      EXPECT_TRUE(near(splats.positions[i], sign * Eigen::Vector3f(1, 2, 4), 0));
      EXPECT_TRUE(near(splats.deviations[i], Eigen::Vector3f::Constant(std::exp(-1.F)), 1e-6F));
      EXPECT_TRUE(near(splats.rotations[i], Eigen::Vector4f(0, 0, 0, 1), 1e-3F));
      EXPECT_FLOAT_EQ(splats.opacities[i], 0.2F);
      EXPECT_NEAR(0.5F + kC0 * harmonic(splats, i, 0, 0), 1, 1e-6);
      EXPECT_NEAR(0.5F + kC0 * harmonic(splats, i, 0, 1), 0, 1e-6);
      const std::size_t rest = splats.coefficients() - 1;
      for (std::size_t k = 1; k <= rest; ++k) {
        for (std::size_t colour = 0; colour < 3; ++colour) {
          const auto byte = static_cast<float>(128 + 4 * i + colour * rest + k - 1);
          EXPECT_FLOAT_EQ(harmonic(splats, i, k, colour), ((byte + 0.5F) / 256 - 0.5F) * 8);
        }
      }
    }
  }
}

TEST(Splats, DotSplatIsKnownByItsName) {
  const Splats splats = load("a.splat", test::dot_splat());
  ASSERT_EQ(splats.size(), 1U);
  EXPECT_EQ(splats.positions[0], Eigen::Vector3f(1, 2, 3));
  EXPECT_EQ(splats.deviations[0], Eigen::Vector3f(0.1F, 0.2F, 0.3F));
  EXPECT_TRUE(near(splats.rotations[0], Eigen::Vector4f(std::sqrt(0.5F), 0, 0, std::sqrt(0.5F)), 1e-6F));
  EXPECT_FLOAT_EQ(splats.opacities[0], 0.4F);
  for (std::size_t colour = 0; colour < 3; ++colour)
    EXPECT_NEAR(0.5F + kC0 * harmonic(splats, 0, 0, colour), (std::array{1.F, 0.F, 0.2F}[colour]), 1e-6);
  EXPECT_TRUE(test::contains(refusal("a.bin", test::dot_splat()), "format is not supported"));
}

/// Signs of the harmonics if y and z change theirs.
constexpr std::array<float, 16> kFlipped = {1, -1, -1, 1, -1, 1, 1, -1, 1, -1, 1, -1, -1, 1, -1, 1};

TEST(Splats, SpzOfEachVersionAndDegree) {
  for (int version = 1; version <= 4; ++version) {
    for (int degree = 0; degree <= 4; ++degree) {
      const TemporaryDirectory folder;
      const Loaded loaded = load_with_warnings(folder.write("a.spz", test::spz(version, degree)));
      EXPECT_EQ(loaded.warnings.size(), degree > 3 ? 1U : 0U);
      const Splats& splats = loaded.splats;
      ASSERT_EQ(splats.size(), 1U);
      EXPECT_EQ(splats.degree, std::min(degree, 3));
      EXPECT_EQ(splats.filter, SplatFilter::dilated);
      EXPECT_EQ(splats.positions[0], Eigen::Vector3f(1, -2, 3));  // right, down, forward
      EXPECT_TRUE(near(splats.deviations[0], Eigen::Vector3f(std::exp(-1.F), std::exp(-2.F), std::exp(-3.F)), 1e-6F));
      EXPECT_TRUE(near(splats.rotations[0], Eigen::Vector4f(0, 0, -std::sqrt(0.5F), std::sqrt(0.5F)),
                       version < 3 ? 0.01F : 1e-6F));
      EXPECT_FLOAT_EQ(splats.opacities[0], 0.2F);
      for (std::size_t colour = 0; colour < 3; ++colour)
        EXPECT_NEAR(harmonic(splats, 0, 0, colour), (std::array{0.5F, -0.5F, -0.3F}[colour]) / 0.15F, 1e-5);
      expect_test_coefficients(splats, 1, kFlipped);
    }
  }
}

TEST(Splats, SpzFlags) {
  EXPECT_EQ(load("a.spz", test::spz(3, 0, 1)).filter, SplatFilter::antialiased);
  EXPECT_EQ(load("a.spz", test::spz(4, 0, 1)).filter, SplatFilter::antialiased);
  for (int version = 3; version <= 4; ++version) {
    const auto axes = [](std::uint32_t system) {
      return test::ByteWriter().put(0xADBE0001U).put(2U).text("xx").put(0xADBE0003U).put(4U).put(system).bytes();
    };
    const Splats splats = load("a.spz", test::spz(version, 3, 2, axes(6)));  // right, down, front
    EXPECT_EQ(splats.positions[0], Eigen::Vector3f(1, 2, -3));
    expect_test_coefficients(splats, 1, kSame);
    const Splats mirrored = load("a.spz", test::spz(version, 0, 2, axes(8)));  // right, up, front
    EXPECT_EQ(mirrored.positions[0], Eigen::Vector3f(1, -2, -3));
    EXPECT_TRUE(near(mirrored.rotations[0], Eigen::Vector4f(0, 0, -std::sqrt(0.5F), std::sqrt(0.5F)), 1e-6F));
    EXPECT_TRUE(test::contains(refusal("a.spz", test::spz(version, 0, 2, axes(9))), "axes"));
  }
}

void expect_sog(const Splats& splats, int version, int degree) {
  ASSERT_EQ(splats.size(), 2U);
  EXPECT_EQ(splats.degree, degree);
  EXPECT_TRUE(near(splats.positions[0], Eigen::Vector3f(0, 0, 0), 1e-4F));
  EXPECT_TRUE(near(splats.positions[1], Eigen::Vector3f(1, 2, -3), 1e-5F));
  EXPECT_TRUE(near(splats.rotations[0], Eigen::Vector4f(std::sqrt(0.5F), 0, 0, std::sqrt(0.5F)), 4e-3F));
  EXPECT_TRUE(near(splats.rotations[1], Eigen::Vector4f(0, 0, 0, 1), 4e-3F));
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_TRUE(near(splats.deviations[i], Eigen::Vector3f(std::exp(-1.F), std::exp(-2.F), std::exp(-3.F)), 1e-6F));
    EXPECT_NEAR(splats.opacities[i], version == 2 ? 0.2F : 0.5F, 1e-5);
    for (std::size_t colour = 0; colour < 3; ++colour) {
      EXPECT_NEAR(harmonic(splats, i, 0, colour), static_cast<float>(colour) - 1, 1e-5);
      for (std::size_t k = 1; k < splats.coefficients(); ++k)
        EXPECT_NEAR(harmonic(splats, i, k, colour), i == 0 ? static_cast<float>(10 * k + colour) / 100 : 0, 1e-5);
    }
  }
}

TEST(Splats, SogOfEachVersionAndDegree) {
  for (int version = 1; version <= 2; ++version) {
    for (int degree = 0; degree <= 3; ++degree) {
      const auto files = test::sog_files(version, degree);
      expect_sog(load("a.sog", test::zip(files)), version, degree);
      const TemporaryDirectory folder;
      for (const auto& [name, content] : files) folder.write(name, content);
      expect_sog(load(folder.path() / "meta.json"), version, degree);
    }
  }
}

TEST(Splats, SogModel) {
  auto files = test::sog_files(2, 0);
  files["meta.json"] = with(files["meta.json"], "\"version\"", "\"model\":\"antialiased\",\"version\"");
  EXPECT_EQ(load("a.sog", test::zip(files)).filter, SplatFilter::antialiased);
}

/// A splat as in plain_ply(), in glTF.
nlohmann::json gltf_primitive(GlbWriter& glb, int degree, const std::string& prefix = "KHR_gaussian_splatting:") {
  nlohmann::json attributes = {{"POSITION", glb.floats({1, 2, 3}, "VEC3")},
                               {prefix + "ROTATION", glb.floats({0, 0, 2, 2}, "VEC4")},
                               {prefix + "SCALE", glb.floats({std::exp(-1.F), std::exp(-2.F), std::exp(-3.F)}, "VEC3")},
                               {prefix + "OPACITY", glb.floats({0.5F}, "SCALAR")}};
  for (int l = 0, k = 0; l <= degree; ++l) {
    for (int n = 0; n < 2 * l + 1; ++n, ++k) {
      const auto values = {test::test_coefficient(k, 0), test::test_coefficient(k, 1), test::test_coefficient(k, 2)};
      attributes[prefix + "SH_DEGREE_" + std::to_string(l) + "_COEF_" + std::to_string(n)] = glb.floats(values, "VEC3");
    }
  }
  return {{"attributes", attributes},
          {"mode", 0},
          {"extensions", {{"KHR_gaussian_splatting", {{"kernel", "ellipse"}, {"colorSpace", "srgb_rec709_display"}}}}}};
}

GlbWriter gltf(int degree, nlohmann::json node = nlohmann::json::object()) {
  GlbWriter glb;
  glb.json["extensionsUsed"] = {"KHR_gaussian_splatting"};
  const auto primitive = gltf_primitive(glb, degree);
  node["mesh"] = glb.add("meshes", {{"primitives", {primitive}}});
  glb.add_node(node);
  return glb;
}

/// The light of a splat from a direction, with the constants of the original 3D Gaussian splatting.
Eigen::Vector3f light(const Splats& splats, const Eigen::Vector3f& d) {
  const float x = d.x(), y = d.y(), z = d.z(), xx = x * x, yy = y * y, zz = z * z;
  const std::array<float, 16> values = {0.28209479F,
                                        -0.4886025F * y,
                                        0.4886025F * z,
                                        -0.4886025F * x,
                                        1.0925484F * x * y,
                                        -1.0925484F * y * z,
                                        0.31539157F * (2 * zz - xx - yy),
                                        -1.0925484F * x * z,
                                        0.5462742F * (xx - yy),
                                        -0.5900436F * y * (3 * xx - yy),
                                        2.8906114F * x * y * z,
                                        -0.4570458F * y * (4 * zz - xx - yy),
                                        0.3731763F * z * (2 * zz - 3 * xx - 3 * yy),
                                        -0.4570458F * x * (4 * zz - xx - yy),
                                        1.4453057F * z * (xx - yy),
                                        -0.5900436F * x * (xx - 3 * yy)};
  Eigen::Vector3f sum = Eigen::Vector3f::Zero();
  for (std::size_t k = 0; k < splats.coefficients(); ++k) {
    for (std::size_t colour = 0; colour < 3; ++colour)
      sum[static_cast<Eigen::Index>(colour)] += values[k] * harmonic(splats, 0, k, colour);
  }
  return sum;
}

Eigen::Matrix3f covariance(const Splats& splats, std::size_t i) {
  const Eigen::Matrix3f half =
      Eigen::Quaternionf(splats.rotations[i]).toRotationMatrix() * splats.deviations[i].asDiagonal();
  return half * half.transpose();
}

TEST(Splats, GltfTurnsWithItsNodes) {
  const Splats plain = load("a.ply", test::plain_ply(3));
  const Eigen::Matrix3f z_up = Eigen::AngleAxisf(std::numbers::pi_v<float> / 2, Eigen::Vector3f::UnitX()).matrix();
  const Eigen::Quaternionf turn(0.5F, 0.1F, -0.7F, 0.5F);
  const Eigen::Matrix3f rotation = turn.normalized().matrix(), mirror = Eigen::Vector3f(-1, 1, 1).asDiagonal();
  const auto check = [&](const nlohmann::json& node, const Eigen::Matrix3f& linear, const Eigen::Vector3f& moved,
                         float scale) {
    for (int degree = 0; degree <= 3; ++degree) {
      const Splats splats = load("a.glb", gltf(degree, node).bytes()), same = load("a.ply", test::plain_ply(degree));
      ASSERT_EQ(splats.size(), 1U);
      EXPECT_EQ(splats.degree, degree);
      const Eigen::Matrix3f to_scene = z_up * linear;
      EXPECT_TRUE(near(splats.positions[0], z_up * (scale * linear * same.positions[0] + moved), 1e-5F));
      const Eigen::Matrix3f expected = scale * scale * to_scene * covariance(same, 0) * to_scene.transpose();
      EXPECT_LT(test::largest_difference(covariance(splats, 0), expected), 1e-5);
      EXPECT_FLOAT_EQ(splats.opacities[0], 0.5F);
      for (const Eigen::Vector3f& d :
           {Eigen::Vector3f(1, 0, 0), Eigen::Vector3f(0.6F, 0, -0.8F), Eigen::Vector3f(0.48F, -0.6F, 0.64F)})
        EXPECT_TRUE(near(light(splats, to_scene * d), light(same, d), 1e-5F));
    }
  };
  check(nlohmann::json::object(), Eigen::Matrix3f::Identity(), Eigen::Vector3f::Zero(), 1);
  check({{"translation", {4, 5, 6}}, {"rotation", {0.1, -0.7, 0.5, 0.5}}, {"scale", {2, 2, 2}}}, rotation,
        Eigen::Vector3f(4, 5, 6), 2);
  check({{"scale", {-2, 2, 2}}}, mirror, Eigen::Vector3f::Zero(), 2);
  EXPECT_TRUE(test::contains(refusal("a.glb", gltf(0, {{"scale", {1, 2, 1}}}).bytes()), "uniform"));
}

TEST(Splats, GltfOfOtherKinds) {
  GlbWriter linear = gltf(0);
  auto& primitive = linear.json["meshes"][0]["primitives"][0];
  auto& extension = primitive["extensions"]["KHR_gaussian_splatting"];
  extension["colorSpace"] = "lin_rec709_display";
  EXPECT_EQ(load("a.glb", linear.bytes()).light, SplatLight::linear);
  extension["colorSpace"] = "other";
  EXPECT_TRUE(test::contains(refusal("a.glb", linear.bytes()), "colorSpace"));
  extension["colorSpace"] = "srgb_rec709_display";
  extension["kernel"] = "other";
  EXPECT_TRUE(test::contains(refusal("a.glb", linear.bytes()), "kernel"));
  extension["kernel"] = "ellipse";
  extension["extensions"] = {{"KHR_gaussian_splatting_compression_spz_2", nlohmann::json::object()}};
  EXPECT_TRUE(test::contains(refusal("a.glb", linear.bytes()), "KHR_gaussian_splatting_compression_spz_2"));
  extension.erase("extensions");
  primitive["attributes"].erase("KHR_gaussian_splatting:SCALE");
  EXPECT_TRUE(test::contains(refusal("a.glb", linear.bytes()), "SCALE"));

  // Bytes that are not normalised.
  const auto with_scales = [](const std::array<std::int8_t, 3>& scales, int component) {
    GlbWriter bytes = gltf(0);
    const std::size_t view = bytes.add_view(scales.data(), scales.size());
    bytes.json["meshes"][0]["primitives"][0]["attributes"]["KHR_gaussian_splatting:SCALE"] =
        bytes.add("accessors", {{"bufferView", view}, {"componentType", component}, {"count", 1}, {"type", "VEC3"}});
    return load("a.glb", bytes.bytes()).deviations[0];
  };
  EXPECT_EQ(with_scales({1, 2, 3}, 5121), Eigen::Vector3f(1, 2, 3));
  EXPECT_FLOAT_EQ(with_scales({-1, -2, -3}, 5120).y(), std::exp(-2.F));  // logarithms, in a draft

  // The first draft.
  GlbWriter draft;
  nlohmann::json first = gltf_primitive(draft, 0, "_");
  first["attributes"].erase("_OPACITY");
  first["attributes"].erase("_SH_DEGREE_0_COEF_0");
  first["attributes"]["COLOR_0"] = draft.floats({1, 0, 0.25F, 0.75F}, "VEC4");
  draft.add_node({{"mesh", draft.add("meshes", {{"primitives", {first}}})}});
  const Splats splats = load("a.glb", draft.bytes());
  EXPECT_FLOAT_EQ(splats.opacities[0], 0.75F);
  EXPECT_FLOAT_EQ(0.5F + kC0 * harmonic(splats, 0, 0, 2), 0.25F);
  EXPECT_FLOAT_EQ(splats.deviations[0].y(), std::exp(-2.F));
}

TEST(Splats, TrianglesAreForAnotherRenderer) {
  const TemporaryDirectory folder;
  const std::string header =
      "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
      "property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n";
  GlbWriter glb;
  glb.add_node({{"mesh", glb.add_triangle()}});
  for (const auto& path :
       {folder.write("a.ply", header + "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"), folder.write("a.glb", glb.bytes())}) {
    EXPECT_FALSE(is_splat_file(path));
    EXPECT_TRUE(test::contains(refusal(path), "use the renderer 'mesh'"));
  }
  EXPECT_FALSE(is_splat_file(folder.path() / "none.ply"));
  EXPECT_FALSE(is_splat_file(folder.path()));
  EXPECT_FALSE(is_splat_file(folder.write("a.zip", test::zip({{"a.txt", "a"}}))));
  EXPECT_FALSE(is_splat_file(folder.write("a.gz", test::gzip("some text"))));
  EXPECT_TRUE(test::contains(refusal(folder.path() / "none.ply"), "no such file"));
}

TEST(Splats, DamagedSplatsAreDropped) {
  const float nan = std::numeric_limits<float>::quiet_NaN(), infinite = std::numeric_limits<float>::infinity();
  const std::vector<std::string> names = {"x",       "y",       "z",       "f_dc_0", "f_dc_1", "f_dc_2", "opacity",
                                          "scale_0", "scale_1", "scale_2", "rot_0",  "rot_1",  "rot_2",  "rot_3"};
  const std::vector<std::vector<float>> rows = {
      {1, 2, 3, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0},                  // valid
      {nan, 2, 3, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0},                // position
      {1, infinite, 3, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0},           // position
      {1, 2, 3, 0, nan, 0, 0, 0, 0, 0, 1, 0, 0, 0},                // colour
      {1, 2, 3, 0, 0, 0, nan, 0, 0, 0, 1, 0, 0, 0},                // opacity
      {1, 2, 3, 0, 0, 0, 0, 0, 14, 0, 1, 0, 0, 0},                 // deviation above 1e6 m
      {1, 2, 3, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0},                  // rotation of zero
      {1, 2, 3, 0, 0, 0, 0, 0, 0, 0, 1, nan, 0, 0},                // rotation
      {1, 2, 3, 0, 0, 0, infinite, -infinite, 0, 0, 1, 0, 0, 0}};  // valid: opacity 1, deviation 0
  test::ByteWriter out;
  out.text("ply\nformat binary_little_endian 1.0\nelement vertex " + std::to_string(rows.size()) + "\n");
  for (const std::string& name : names) out.text("property float " + name + "\n");
  out.text("end_header\n");
  for (const auto& row : rows) {
    for (const float value : row) out.put(value);
  }
  const TemporaryDirectory folder;
  const Loaded loaded = load_with_warnings(folder.write("a.ply", out.bytes()));
  ASSERT_EQ(loaded.warnings.size(), 1U);
  EXPECT_TRUE(test::contains(loaded.warnings[0], "7 of 9 splats"));
  ASSERT_EQ(loaded.splats.size(), 2U);
  EXPECT_EQ(loaded.splats.opacities[1], 1);
  EXPECT_EQ(loaded.splats.deviations[1].x(), 0);
  EXPECT_EQ(loaded.splats.harmonics.size(), 6U);

  test::ByteWriter negative;  // the deviation of a .splat
  negative.text(test::dot_splat().substr(0, 12)).put(-0.1F).text(test::dot_splat().substr(16));
  EXPECT_TRUE(test::contains(refusal("a.splat", negative.bytes()), "all 1 splats are invalid"));
}

TEST(Splats, HugeCountsAreRefused) {
  const auto ply = [](const std::string& count) {
    return refusal("a.ply", with(test::plain_ply(3), "vertex 1", "vertex " + count));
  };
  EXPECT_TRUE(test::contains(ply("4000000000"), "the file ends within row 2 of 4000000000"));
  EXPECT_TRUE(test::contains(ply("18446744073709551615"), "the file ends within row 2"));
  EXPECT_TRUE(test::contains(ply("18446744073709551616"), "integer"));
  EXPECT_TRUE(test::contains(ply("-1"), "integer"));
  EXPECT_TRUE(test::contains(ply("0"), "no splats"));
  EXPECT_TRUE(
      test::contains(refusal("a.ply", with(test::compressed_ply(0), "vertex 2", "vertex 300")), "row 3 of 300"));
  EXPECT_TRUE(test::contains(refusal("a.ply", with(test::compressed_ply(1), "sh 2", "sh 1")), "sh"));

  std::string text = test::spz_header(3, 4'000'000'000U, 3, 0);
  EXPECT_TRUE(test::contains(refusal("a.spz", test::gzip(text)), "cannot hold"));
  text = test::spz_header(3, 1000, 3, 0);
  EXPECT_TRUE(test::contains(refusal("a.spz", test::gzip(text + std::string(200, 'x'))), "must have 1000 splats"));
  const std::string spz = test::spz(4, 0);
  EXPECT_TRUE(test::contains(refusal("a.spz", with(spz, spz.substr(8, 4), "\xFF\xFF\xFF\xFF")), "cannot hold"));

  for (int version = 1; version <= 2; ++version) {
    auto files = test::sog_files(version, 0);
    files["meta.json"] = version == 1 ? with(files["meta.json"], "\"shape\":[2", "\"shape\":[200000")
                                      : with(files["meta.json"], "\"count\":2", "\"count\":200000");
    EXPECT_TRUE(test::contains(refusal("a.sog", test::zip(files)), "cannot hold 200000 splats"));
    files["meta.json"] = with(files["meta.json"], "200000", "20");
    EXPECT_TRUE(test::contains(refusal("a.sog", test::zip(files)), "must have at least 20 pixels"));
    files["sh0.webp"] = test::webp(2048, std::vector<std::array<int, 4>>(std::size_t{2048} * 1024));
    files["meta.json"] = with(files["meta.json"], "20", "2");
    EXPECT_TRUE(test::contains(refusal("a.sog", test::zip(files)), "image sh0.webp is damaged"));
  }

  GlbWriter glb = gltf(0);  // many copies of a splat
  glb.json["nodes"] = nlohmann::json::array();
  glb.json["scenes"][0]["nodes"] = nlohmann::json::array();
  for (int i = 0; i < 2000; ++i) glb.add_node({{"mesh", 0}});
  EXPECT_TRUE(test::contains(refusal("a.glb", glb.bytes()), "cannot hold 2000 splats"));
}

TEST(Splats, SogMayOnlyReadItsFolder) {
  const TemporaryDirectory folder;
  std::filesystem::create_directories(folder.path() / "scene");
  auto files = test::sog_files(2, 0);
  folder.write("secret.webp", files["sh0.webp"]);
  files["meta.json"] = with(files["meta.json"], "\"sh0.webp\"", "\"../secret.webp\"");
  for (const auto& [name, content] : files) folder.write("scene/" + name, content);
  EXPECT_TRUE(test::contains(refusal(folder.path() / "scene" / "meta.json"), "outside"));
  files.erase("scales.webp");
  EXPECT_TRUE(test::contains(refusal("a.sog", test::zip(files)), "scales.webp in the zip is missing"));
}

/// A small file of each format.
std::vector<std::pair<std::string, std::string>> small_files() {
  return {{"plain.ply", test::plain_ply(1)},
          {"compressed.ply", test::compressed_ply(1)},
          {"a.splat", test::dot_splat()},
          {"1.spz", test::spz(1, 1)},
          {"3.spz", test::spz(3, 1)},
          {"4.spz", test::spz(4, 1)},
          {"1.sog", test::zip(test::sog_files(1, 1))},
          {"2.sog", test::zip(test::sog_files(2, 1))},
          {"a.glb", gltf(1).bytes()}};
}

TEST(Splats, TruncatedFilesAreRefused) {
  const TemporaryDirectory folder;
  for (const auto& [name, content] : small_files()) {
    const auto path = folder.write(name, content);
    load(path);
    for (std::size_t size = content.size(); size-- > 0;) {
      std::filesystem::resize_file(path, size);
      EXPECT_NE(refusal(path), "nothing was thrown") << size;
    }
  }
}

TEST(Splats, DamagedFilesDoNotCrash) {
  const TemporaryDirectory folder;
  for (const auto& [name, content] : small_files()) {
    const auto path = folder.write(name, content);
    std::fstream file(path, std::ios::binary | std::ios::in | std::ios::out);
    const auto put = [&file, &content = content](std::size_t at, int bits) {
      file.seekp(static_cast<std::streamoff>(at)).put(static_cast<char>(content[at] ^ bits)).flush();
    };
    for (std::size_t at = 0; at < content.size(); ++at) {
      for (const int bits : {0x01, 0x80, 0xFF}) {
        put(at, bits);
        is_splat_file(path);
        try {
          load_splats(path, [](const std::string&) {});
        } catch (const UserError&) {
        }
      }
      put(at, 0);
    }
    load(path);
  }
}

TEST(Splats, RealFilesOfTwoFormatsAgree) {
  const auto guitar = test::test_data("splats/guitar.compressed.ply"),
             ply = test::test_data("splats/biker.compressed.ply"), spz = test::test_data("splats/biker.spz");
  if (!guitar || !ply || !spz) GTEST_SKIP() << "needs real splats";
  EXPECT_EQ(load(*guitar).size(), 90'854U);
  const Splats a = load(*ply), b = load(*spz);
  ASSERT_EQ(a.size(), 152'746U);
  ASSERT_EQ(b.size(), a.size());
  Eigen::Vector3f position = Eigen::Vector3f::Zero();
  double covariances = 0, opacities = 0, colours = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    position = position.cwiseMax((a.positions[i] - b.positions[i]).cwiseAbs());
    covariances += (covariance(a, i) - covariance(b, i)).norm() / covariance(a, i).norm();
    opacities += std::abs(a.opacities[i] - b.opacities[i]);
    for (std::size_t colour = 0; colour < 3; ++colour)
      colours += kC0 * std::abs(harmonic(a, i, 0, colour) - harmonic(b, i, 0, colour));
  }
  const auto count = static_cast<double>(a.size());
  EXPECT_LT(position.maxCoeff(), 2e-3F);
  EXPECT_LT(covariances / count, 0.1);
  EXPECT_LT(opacities / count, 0.005);
  EXPECT_LT(colours / count, 0.01);
}

}  // namespace
}  // namespace esim
