#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <fstream>
#include <functional>
#include <limits>
#include <opencv2/imgcodecs.hpp>

#include "esim/core/error.h"
#include "esim/scene/images/image_file.h"
#include "esim/scene/scene_file.h"
#include "glb_writer.h"
#include "support/errors.h"
#include "support/sanitizers.h"
#include "support/temporary_directory.h"

namespace esim {
namespace {

using test::GlbWriter;
using test::TemporaryDirectory;

/// The one-line error for a scene.
std::string refusal(const std::filesystem::path& path) {
  const std::string message = test::message_of<UserError>([&] { load_scene_file(path, [](const std::string&) {}); });
  EXPECT_EQ(message.find('\n'), std::string::npos) << message;
  EXPECT_TRUE(test::contains(message, path.filename().string()));
  return message;
}

std::string refusal(const GlbWriter& glb) {
  const TemporaryDirectory folder;
  return refusal(folder.write("scene.glb", glb.bytes()));
}

GlbWriter plain() {
  GlbWriter glb;
  glb.add_node({{"mesh", glb.add_triangle()}});
  return glb;
}

TEST(HostileScene, GltfThatLiesIsRefused) {
  GlbWriter out_of_range = plain();
  out_of_range.json["meshes"][0]["primitives"][0]["indices"] = out_of_range.indices({0, 1, 9});
  EXPECT_TRUE(test::contains(refusal(out_of_range), "a missing vertex"));

  GlbWriter absurd = plain();
  absurd.json["accessors"][0]["count"] = 4'000'000'000U;
  EXPECT_TRUE(test::contains(refusal(absurd), "beyond the end of its bufferView"));

  GlbWriter beyond = plain();
  beyond.json["bufferViews"][0]["byteOffset"] = 4'294'967'295U;
  EXPECT_TRUE(test::contains(refusal(beyond), "beyond the end of its buffer"));

  GlbWriter strange = plain();
  strange.json["meshes"][0]["primitives"][0]["indices"] = -1;
  EXPECT_TRUE(test::contains(refusal(strange), "is damaged"));

  GlbWriter circular = plain();
  circular.json["nodes"][0]["children"] = {0};
  EXPECT_TRUE(test::contains(refusal(circular), "two parents"));

  GlbWriter not_finite;
  nlohmann::json primitive = {
      {"attributes",
       {{"POSITION", not_finite.floats({0, 0, 0, 1, 0, 0, 0, std::numeric_limits<float>::quiet_NaN(), 0}, "VEC3")}}}};
  not_finite.add("meshes", {{"primitives", {primitive}}});
  not_finite.add_node({{"mesh", 0}});
  EXPECT_TRUE(test::contains(refusal(not_finite), "not finite"));

  GlbWriter compressed = plain();
  compressed.json["extensionsRequired"] = {"VENDOR_compression"};
  EXPECT_TRUE(test::contains(refusal(compressed), "VENDOR_compression"));

  GlbWriter empty;
  EXPECT_TRUE(test::contains(refusal(empty), "no triangles"));
}

TEST(HostileScene, ASmallFileCannotAskForManyTriangles) {
  GlbWriter glb;
  std::vector<std::uint16_t> corners(30'000);
  for (std::size_t i = 0; i < corners.size(); ++i) corners[i] = static_cast<std::uint16_t>(i % 3);
  const std::size_t mesh = glb.add_triangle();
  glb.json["meshes"][mesh]["primitives"][0]["indices"] = glb.indices(corners);
  for (int i = 0; i < 2000; ++i) glb.add_node({{"mesh", mesh}});  // 20 million triangles
  EXPECT_TRUE(test::contains(refusal(glb), "triangles; simplify it"));
}

TEST(HostileScene, ObjThatLiesIsRefused) {
  const TemporaryDirectory folder;
  EXPECT_TRUE(test::contains(refusal(folder.write("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 900\n")), "a.obj"));
  EXPECT_TRUE(test::contains(refusal(folder.write("b.obj", "v 0 0 0\nv nan 0 0\nv 0 1 0\nf 1 2 3\n")), "not finite"));
  EXPECT_TRUE(test::contains(refusal(folder.write("c.obj", "")), "c.obj"));
  EXPECT_TRUE(test::contains(refusal(folder.write("d.xyz", "")), "format is not supported"));
  EXPECT_TRUE(test::contains(refusal(folder.path() / "none.glb"), "no such file"));
}

/// Warnings of an OBJ file whose only texture has this name.
std::vector<std::string> warnings_of_texture(const TemporaryDirectory& folder, const std::string& name) {
  std::filesystem::create_directories(folder.path() / "scene");
  folder.write("scene/a.mtl", "newmtl paint\nmap_Kd " + name + "\n");
  const auto obj =
      folder.write("scene/a.obj", "mtllib a.mtl\nusemtl paint\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nf 1/1 2/1 3/1\n");
  std::vector<std::string> warnings;
  const SceneFile file = load_scene_file(obj, [&](const std::string& text) { warnings.push_back(text); });
  EXPECT_FLOAT_EQ(file.scene.objects.at(0).mesh.materials.at(file.scene.objects[0].mesh.material[0]).base, 0.2F)
      << name;
  return warnings;
}

TEST(HostileScene, TexturesComeFromTheScenesFolderOnly) {
  const TemporaryDirectory folder;
  cv::imwrite((folder.path() / "secret.png").string(), cv::Mat(2, 2, CV_8UC3, cv::Scalar(1, 2, 3)));
  const std::string absolute = (folder.path() / "secret.png").string();
  for (const std::string& name : {std::string("../secret.png"), absolute, "file://" + absolute,
                                  std::string("../../../../../etc/passwd"), std::string("x/../../secret.png")}) {
    const auto warnings = warnings_of_texture(folder, name);
    ASSERT_EQ(warnings.size(), 1U) << name;
    EXPECT_TRUE(test::contains(warnings[0], "paint")) << name;
  }
  std::filesystem::create_symlink(absolute, folder.path() / "scene" / "link.png");
  EXPECT_EQ(warnings_of_texture(folder, "link.png").size(), 1U);
  EXPECT_TRUE(test::contains(warnings_of_texture(folder, "gone.png").at(0), "no such file"));
}

TEST(HostileScene, GltfReadsNoFilesElsewhere) {
  const TemporaryDirectory folder;
  folder.write("secret.bin", std::string(1000, '\0'));
  std::filesystem::create_directories(folder.path() / "scene");
  for (const char* const uri : {"../secret.bin", "%2e%2e/secret.bin", "file:///etc/passwd", "/etc/passwd"}) {
    const nlohmann::json json = {{"asset", {{"version", "2.0"}}}, {"buffers", {{{"uri", uri}, {"byteLength", 4}}}}};
    EXPECT_TRUE(test::contains(refusal(folder.write("scene/a.gltf", json.dump())), "its buffer")) << uri;
  }
}

std::string png_header(std::uint32_t width, std::uint32_t height) {
  const auto big_endian = [](std::uint32_t v) {
    return std::string{static_cast<char>(v >> 24), static_cast<char>(v >> 16), static_cast<char>(v >> 8),
                       static_cast<char>(v)};
  };
  return "\x89PNG\r\n\x1a\n" + std::string("\0\0\0\rIHDR", 8) + big_endian(width) + big_endian(height) +
         std::string("\x08\x02\0\0\0", 5) + std::string(40, '\0');
}

TEST(HostileImage, AbsurdSizesAreRefusedBeforeDecoding) {
  const TemporaryDirectory folder;
  const auto message = [&](const std::string& name, const std::string& content) {
    return test::message_of<UserError>([&] { load_luminance(folder.write(name, content)); });
  };
  EXPECT_TRUE(test::contains(message("a.png", png_header(100'000, 100'000)), "100000x100000 pixels"));
  EXPECT_TRUE(test::contains(message("b.png", png_header(16'000, 16'000)), "cut off or damaged"));

  std::vector<unsigned char> jpeg;
  cv::imencode(".jpg", cv::Mat(8, 8, CV_8UC3, cv::Scalar(1, 2, 3)), jpeg);
  std::string text(jpeg.begin(), jpeg.end());
  const std::size_t frame = text.find("\xFF\xC0");
  text.replace(frame + 5, 4, "\xFF\xFF\xFF\xFF");
  EXPECT_TRUE(test::contains(message("a.jpg", text), "65535x65535 pixels"));

  for (const int quality : {80, 101}) {  // lossy and lossless
    std::vector<unsigned char> webp;
    cv::imencode(".webp", cv::Mat(8, 8, CV_8UC3, cv::Scalar(1, 2, 3)), webp, {cv::IMWRITE_WEBP_QUALITY, quality});
    std::string claim(webp.begin(), webp.end());
    claim.replace(quality > 100 ? 21 : 26, 4, quality > 100 ? "\xFF\xFF\xFF\x0F" : "\xFF\x3F\xFF\x3F");
    const std::string refusal = message("a.webp", claim);
    EXPECT_TRUE(test::contains(refusal, quality > 100 ? "16384x16384 pixels" : "16383x16383 pixels")) << refusal;
  }
  EXPECT_TRUE(test::contains(message("a.pgm", "P5 20000 20000 255\n1234"), "cannot be decoded"));
  EXPECT_TRUE(test::contains(message("a.hdr", "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 100000 +X 100000\n"),
                             "100000x100000 pixels"));
}

/// What became of damaged copies of a file.
struct Outcome {
  int read = 0, refused = 0;
  std::string failure;  ///< the first copy that was neither read correctly nor refused with a one-line error
};

/// Reads a file; returns what is wrong with its content.
using Reader = std::function<std::string(const std::filesystem::path&)>;

/// Reads one copy.
void try_copy(const Reader& reader, const std::filesystem::path& path, Outcome& outcome) {
  std::string failure;
  try {
    failure = reader(path);
    ++outcome.read;
  } catch (const UserError& error) {
    ++outcome.refused;
    const std::string message = error.what();
    if (message.empty() || message.find('\n') != std::string::npos) failure = "not one line: " + message;
  } catch (const std::exception& error) {
    failure = std::string("not a UserError: ") + error.what();
  }
  if (outcome.failure.empty()) outcome.failure = failure;
}

/// Reads copies of a file, each cut off or with a few flipped bits, in another process with at most 2 GiB.
Outcome read_damaged(const std::string& name, const std::string& content, const Reader& reader, int cases = 300) {
  const TemporaryDirectory folder;
  const std::filesystem::path report = folder.path() / "report";
  const pid_t copy = fork();
  if (copy == 0) {
    const rlimit limit{rlim_t{1} << 31, rlim_t{1} << 31};
    if (!test::kSanitized) setrlimit(RLIMIT_AS, &limit);
    if (std::freopen("/dev/null", "w", stderr) == nullptr) _exit(4);  // decoders print errors there
    std::uint64_t state = 1;
    const auto random = [&](std::size_t below) {
      state = state * 6364136223846793005U + 1442695040888963407U;
      return static_cast<std::size_t>(state >> 33) % below;
    };
    Outcome outcome;
    for (int i = 0; i < cases; ++i) {
      std::string damaged = content;
      if (i % 4 == 0) damaged.resize(random(damaged.size()));
      for (std::size_t flips = i % 4 == 0 ? 0 : 1 + random(8); flips > 0; --flips)
        damaged[random(damaged.size())] ^= static_cast<char>(1U << random(8));
      try_copy(reader, folder.write(name, damaged), outcome);
    }
    std::ofstream(report) << outcome.read << ' ' << outcome.refused << ' ' << outcome.failure;
    _exit(0);
  }
  int status = 0;
  Outcome outcome;
  if (copy < 0 || waitpid(copy, &status, 0) != copy) outcome.failure = "cannot run another process";
  if (WIFSIGNALED(status)) outcome.failure = "ended by signal " + std::to_string(WTERMSIG(status));
  std::ifstream in(report);
  if (outcome.failure.empty() && !(in >> outcome.read >> outcome.refused)) outcome.failure = "ended without a result";
  if (outcome.failure.empty()) std::getline(in >> std::ws, outcome.failure, '\0');
  return outcome;
}

/// Some copies can be read and some cannot; none is read wrongly.
void expect_read_or_refused(const Outcome& outcome) {
  EXPECT_EQ(outcome.failure, "");
  EXPECT_GT(outcome.read, 0);
  EXPECT_GT(outcome.refused, 0);
}

std::string problem_with_scene(const std::filesystem::path& path) {
  const SceneFile file = load_scene_file(path, [](const std::string&) {});
  for (const SceneObject& object : file.scene.objects) {
    const Mesh& mesh = object.mesh;
    if (mesh.triangles.empty() || mesh.material.size() != mesh.triangles.size() ||
        mesh.texture_uv.size() != mesh.triangles.size())
      return "not one material and texture coordinate per triangle";
    for (const Eigen::Vector3f& vertex : mesh.vertices)
      if (!vertex.allFinite()) return "a vertex is not finite";
    for (const auto& triangle : mesh.triangles)
      for (const std::uint32_t index : triangle)
        if (index >= mesh.vertices.size()) return "a triangle has a missing vertex";
    for (const std::uint32_t index : mesh.material)
      if (index >= mesh.materials.size()) return "a triangle has a missing material";
  }
  return "";
}

std::string problem_with_image(const std::filesystem::path& path) {
  const Image<float> image = load_luminance(path);
  if (image.size() == 0) return "no pixels";
  for (const float pixel : image.pixels())
    if (!(pixel >= 0 && pixel <= 1.0001F)) return "a pixel is not within 0 and 1";
  return "";
}

std::string png() {
  cv::Mat image(16, 16, CV_8UC3);
  cv::randu(image, 0, 255);
  std::vector<unsigned char> bytes;
  cv::imencode(".png", image, bytes);
  return {bytes.begin(), bytes.end()};
}

TEST(HostileScene, DamagedGlbIsReadOrRefused) {
  GlbWriter glb;
  const std::string image = png();
  glb.add("images", {{"bufferView", glb.add_view(image.data(), image.size())}});
  glb.add("textures", {{"source", 0}});
  glb.add("materials", {{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}}}});
  glb.add("cameras", {{"type", "perspective"}, {"perspective", {{"yfov", 1.0}, {"aspectRatio", 2.0}}}});
  glb.add_node({{"camera", 0}});
  const std::size_t node = glb.add_node({{"mesh", glb.add_triangle(0)}});
  glb.animate(node, "rotation", {0, 1, 2}, {0, 0, 0, 1, 0, 1, 0, 0, 0, 0, 0, 1});
  expect_read_or_refused(read_damaged("scene.glb", glb.bytes(), problem_with_scene));
}

TEST(HostileScene, DamagedObjIsReadOrRefused) {
  std::string obj = "mtllib none.mtl\no thing\n";
  for (int i = 0; i < 20; ++i) obj += "v 0.5 " + std::to_string(i) + " 1\nvt 0.5 0.25\nvn 0 0 1\n";
  for (int i = 1; i < 18; ++i) {
    const auto corner = [&](int k) {
      return " " + std::to_string(i + k) + "/" + std::to_string(i) + "/" + std::to_string(i);
    };
    obj += "f" + corner(0) + corner(1) + corner(2) + "\n";
  }
  expect_read_or_refused(read_damaged("scene.obj", obj, problem_with_scene, 150));  // one process per copy
}

TEST(HostileImage, DamagedPngIsRefused) {
  const Outcome outcome = read_damaged("image.png", png(), problem_with_image);
  EXPECT_EQ(outcome.failure, "");
  EXPECT_EQ(outcome.read, 0);  // all parts of the file have checksums
  EXPECT_EQ(outcome.refused, 300);
}

}  // namespace
}  // namespace esim
