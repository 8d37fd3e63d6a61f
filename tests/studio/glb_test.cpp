#include "esim/studio/scene_view/glb.h"

#include <gtest/gtest.h>

#include <array>
#include <cstring>
#include <opencv2/imgcodecs.hpp>

#include "esim/core/parallel.h"
#include "esim/studio/server/json.h"

namespace esim::studio {
namespace {

std::shared_ptr<const CodedTexture> grey(int level) {
  std::vector<unsigned char> png;
  cv::imencode(".png", cv::Mat(8, 8, CV_8UC3, cv::Scalar::all(level)), png);
  CodedTexture texture{"grey"};
  texture.opaque = true;
  texture.bytes.resize(png.size());
  std::memcpy(texture.bytes.data(), png.data(), png.size());
  return std::make_shared<const CodedTexture>(std::move(texture));
}

/// The only material of a scene with one triangle, in the page's file, and the number of its textures.
std::pair<Json, std::size_t> page_material(const Material& material, bool lit) {
  Mesh mesh;
  mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  mesh.triangles = {{0, 1, 2}};
  mesh.texture_uv = {{Eigen::Vector2f(0, 0), {1, 0}, {0, 1}}};
  mesh.material = {0};
  mesh.materials = {material};
  mesh.coloured = {mesh.materials, mesh.materials, mesh.materials};
  Scene scene;
  scene.objects.push_back({"triangle", mesh, false});
  if (lit) scene.lighting.emplace().glossy = true;
  const std::string glb = make_glb(scene, Workers(1)).bytes;
  std::uint32_t length = 0;
  std::memcpy(&length, glb.data() + 12, sizeof length);
  const Json json = Json::parse(glb.substr(20, length));
  return {json["materials"][0], json.contains("textures") ? json["textures"].size() : 0};
}

TEST(Glb, MaterialsHaveTheTexturesOfTheirGloss) {
  Gloss gloss{.metallic = 0.5F, .roughness = 0.25F};
  gloss.coded_roughness = gloss.coded_metallic = grey(100);
  gloss.coded_normals = grey(128), gloss.normal_scale = 0.5F;
  Material material{"enamel", nullptr};
  material.coded = grey(200);
  material.gloss = std::make_shared<const Gloss>(gloss);
  const auto [page, textures] = page_material(material, true);
  EXPECT_EQ(textures, 3U);
  const Json& surface = page["pbrMetallicRoughness"];
  EXPECT_EQ(surface["metallicFactor"], 0.5);
  EXPECT_EQ(surface["roughnessFactor"], 0.25);
  const std::array<int, 3> indices{surface["baseColorTexture"]["index"], surface["metallicRoughnessTexture"]["index"],
                                   page["normalTexture"]["index"]};
  EXPECT_EQ(indices, (std::array<int, 3>{0, 1, 2}));
  EXPECT_EQ(page["normalTexture"]["scale"], 0.5);
}

TEST(Glb, UnlitMaterialsDoNotShine) {
  Gloss gloss;
  gloss.coded_normals = grey(128);
  Material material{"sign", nullptr};
  material.gloss = std::make_shared<const Gloss>(gloss);
  EXPECT_FALSE(page_material(material, false).first.contains("normalTexture"));
  material.unlit = true;
  EXPECT_FALSE(page_material(material, true).first.contains("normalTexture"));
}

/// glTF has one image for both.
TEST(Glb, DifferentImagesOfRoughnessAndMetallicFactorAreLeftOut) {
  Gloss gloss{.metallic = 1};
  gloss.coded_roughness = grey(100);
  gloss.coded_metallic = grey(50);
  Material material{"rust", nullptr};
  material.gloss = std::make_shared<const Gloss>(gloss);
  EXPECT_FALSE(page_material(material, true).first["pbrMetallicRoughness"].contains("metallicRoughnessTexture"));
  gloss.metallic = 0, gloss.coded_metallic = nullptr;  // then the image of the roughness is enough
  material.gloss = std::make_shared<const Gloss>(gloss);
  EXPECT_TRUE(page_material(material, true).first["pbrMetallicRoughness"].contains("metallicRoughnessTexture"));
}

TEST(Glb, ATextureThatCannotBeDecodedIsLeftOut) {
  Gloss gloss;
  gloss.coded_normals = std::make_shared<const CodedTexture>(CodedTexture{"torn", {}, {std::byte{1}}});
  Material material{"torn", nullptr};
  material.gloss = std::make_shared<const Gloss>(gloss);
  const auto [page, textures] = page_material(material, true);
  EXPECT_EQ(textures, 0U);
  EXPECT_FALSE(page.contains("normalTexture"));
}

}  // namespace
}  // namespace esim::studio
