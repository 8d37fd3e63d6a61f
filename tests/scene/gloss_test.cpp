// How materials shine, as files say it.
#include <gtest/gtest.h>

#include <fstream>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "esim/scene/scene_file.h"
#include "scene/glb_writer.h"
#include "support/temporary_directory.h"

namespace esim {
namespace {

using Json = nlohmann::json;

class GlossFiles : public testing::Test {
 protected:
  std::filesystem::path path(const std::string& name) const { return directory_.path() / name; }

  void write(const std::string& name, const std::string& text) const {
    std::ofstream(path(name), std::ios::binary) << text;
  }

  /// An image of 4 x 4 texels of one colour.
  void write_image(const std::string& name, int red, int green, int blue) const {
    cv::imwrite(path(name).string(), cv::Mat(4, 4, CV_8UC3, cv::Scalar(blue, green, red)));
  }

  SceneFile load(const std::string& name, SurfaceModel model = SurfaceModel::glossy) {
    warnings_.clear();
    return load_scene_file(
        path(name), [&](const std::string& text) { warnings_ += text + "\n"; }, SceneLook::colour, model);
  }

  /// A triangle with a material.
  Mesh load_material(const Json& material, SurfaceModel model = SurfaceModel::glossy) {
    test::GlbWriter glb;
    for (const char* const name : {"mr.png", "normal.png", "missing.png"}) {
      glb.add("images", {{"uri", name}});
      glb.add("textures", {{"source", glb.json["images"].size() - 1}});
    }
    glb.add("materials", material);
    glb.add_node({{"mesh", glb.add_triangle(0)}});
    write("scene.glb", glb.bytes());
    return load("scene.glb", model).scene.objects.at(0).mesh;
  }

  bool warns_of(const std::string& text) const { return warnings_.find(text) != std::string::npos; }

  test::TemporaryDirectory directory_;
  std::string warnings_;
};

TEST_F(GlossFiles, GltfHasFactorsAndExtensions) {
  const Mesh mesh = load_material(
      {{"name", "paint"},
       {"pbrMetallicRoughness", {{"metallicFactor", 0.25}, {"roughnessFactor", 0.5}}},
       {"extensions", {{"KHR_materials_ior", {{"ior", 2.0}}}, {"KHR_materials_specular", {{"specularFactor", 0.5}}}}}});
  const Gloss& gloss = *mesh.materials.at(0).gloss;
  EXPECT_FLOAT_EQ(gloss.metallic, 0.25F);
  EXPECT_FLOAT_EQ(gloss.roughness, 0.5F);
  EXPECT_NEAR(gloss.reflectance, 0.5 / 9, 1e-6);
  EXPECT_FLOAT_EQ(gloss.edge_reflectance, 0.5F);
  for (const auto& colour : mesh.coloured) EXPECT_EQ(colour.at(0).gloss, mesh.materials[0].gloss) << "shared";
  EXPECT_EQ(warnings_, "");
}

TEST_F(GlossFiles, DefaultsAreThoseOfTheFormat) {
  const Gloss metal = *load_material({{"pbrMetallicRoughness", Json::object()}}).materials.at(0).gloss;
  EXPECT_EQ(metal.metallic, 1);
  EXPECT_EQ(metal.roughness, 1);
  EXPECT_FLOAT_EQ(metal.reflectance, 0.04F);
  EXPECT_EQ(load_material({{"extensions", {{"KHR_materials_unlit", Json::object()}}}}).materials.at(0).gloss, nullptr);
  EXPECT_EQ(load_material({}, SurfaceModel::matte).materials.at(0).gloss, nullptr);
}

TEST_F(GlossFiles, TexturesAreNumbersNotColours) {
  write_image("mr.png", 10, 128, 64);
  write_image("normal.png", 255, 128, 128);
  const Gloss gloss = *load_material({{"pbrMetallicRoughness", {{"metallicRoughnessTexture", {{"index", 0}}}}},
                                      {"normalTexture", {{"index", 1}, {"scale", 0.5}}}})
                           .materials.at(0)
                           .gloss;
  EXPECT_NEAR(gloss.roughness_texture->texels()(1, 1), 128 / 255.0, 1e-3);
  EXPECT_NEAR(gloss.metallic_texture->texels()(2, 1), 64 / 255.0, 1e-3);
  // (1, 0, 0) with x and y halved, and half a code in z, is still along x.
  const Eigen::Vector3f n = Eigen::Vector3f(0.5F, 0.5F / 255, 1.0F / 255).normalized();
  for (int c = 0; c < 3; ++c) {
    EXPECT_NEAR(gloss.normal_textures[static_cast<std::size_t>(c)]->texels()(0, 0), 0.5 + 0.5 * double{n[c]}, 1e-3);
  }
  EXPECT_EQ(warnings_, "");
}

TEST_F(GlossFiles, WhatIsMissingOrOutOfRangeIsNamed) {
  const Gloss gloss =
      *load_material(
           {{"name", "paint"},
            {"pbrMetallicRoughness",
             {{"metallicFactor", -0.5}, {"roughnessFactor", 1.5}, {"metallicRoughnessTexture", {{"index", 2}}}}},
            {"normalTexture", {{"index", 2}}}})
           .materials.at(0)
           .gloss;
  EXPECT_EQ(gloss.metallic, 0);
  EXPECT_EQ(gloss.roughness, 1);
  EXPECT_EQ(gloss.roughness_texture, nullptr);
  EXPECT_EQ(gloss.normal_textures[0], nullptr);
  EXPECT_TRUE(warns_of("material paint: its roughness must be from 0 to 1, not 1.5; it is taken as 1")) << warnings_;
  EXPECT_TRUE(warns_of("its metallic factor must be")) << warnings_;
  EXPECT_TRUE(warns_of("its roughness is 1 everywhere")) << warnings_;
  EXPECT_TRUE(warns_of("its surfaces have no relief")) << warnings_;
}

TEST_F(GlossFiles, MatteScenesReadAndWarnAsBefore) {
  load_material({{"normalTexture", {{"index", 2}}}}, SurfaceModel::matte);
  EXPECT_TRUE(warns_of("1 of its materials have a normal or bump map, which is ignored")) << warnings_;
  EXPECT_FALSE(warns_of("missing.png"));
}

TEST_F(GlossFiles, MtlMayHaveThem) {
  write("scene.obj", "mtllib scene.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\nusemtl b\nf 1 3 2\n");
  write("scene.mtl", "newmtl a\nKd 0.5 0.5 0.5\nPr 0.25\nPm 0.75\nnewmtl b\nKd 0.5 0.5 0.5\nNs 100\n");
  const Mesh mesh = load("scene.obj").scene.objects.at(0).mesh;
  std::map<std::string, Gloss> found;
  for (const Material& material : mesh.materials) found[material.name] = *material.gloss;
  EXPECT_FLOAT_EQ(found["a"].roughness, 0.25F);
  EXPECT_FLOAT_EQ(found["a"].metallic, 0.75F);
  EXPECT_EQ(found["b"].roughness, 1);
  EXPECT_EQ(found["b"].metallic, 0);
}

TEST_F(GlossFiles, MirroringNodesKeepTheFrontOfATriangle) {
  test::GlbWriter glb;
  glb.add("materials", Json::object());
  glb.add_node({{"mesh", glb.add_triangle(0)}, {"scale", {-1, 1, 1}}});
  write("scene.glb", glb.bytes());
  const Mesh mesh = load("scene.glb").scene.objects.at(0).mesh;
  const auto corner = [&](std::size_t i) { return mesh.vertices[mesh.triangles.at(0)[i]]; };
  const Eigen::Vector3f normal = (corner(1) - corner(0)).cross(corner(2) - corner(0));
  EXPECT_LT(normal.y(), 0) << "glTF's +z is -y";
  EXPECT_EQ(mesh.texture_uv[0][1], Eigen::Vector2f(0, 1));
}

}  // namespace
}  // namespace esim
