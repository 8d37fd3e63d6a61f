#include "esim/backends/opengl/lighting/gl_gloss.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>

#include "esim/backends/opengl/gl_context.h"
#include "esim/backends/opengl/gl_program.h"
#include "esim/backends/opengl/gl_shaders.h"
#include "esim/core/error.h"
#include "esim/scene/environment/environment.h"
#include "esim/scene/environment/split_sum.h"

namespace esim::inline backends::inline opengl {
namespace {

/// As in the shader's struct of this name.
struct ShaderArea {
  std::array<float, 4> centre, half_u, half_v, direction;
};

std::array<float, 4> with(const Eigen::Vector3f& v, float last) { return {v.x(), v.y(), v.z(), last}; }

ShaderArea in_camera_frame(const AreaLight& light, const SE3& T_camera_world) {
  const Eigen::Matrix3f R = T_camera_world.rotation.toRotationMatrix().cast<float>();
  const auto count = static_cast<float>(light.samples * light.samples);
  const float part = 4 * light.half_u.norm() * light.half_v.norm() / count;
  const Eigen::Vector3f centre = (T_camera_world * light.position.cast<double>()).cast<float>();
  return {with(centre, static_cast<float>(light.samples)), with(R * light.half_u, light.strength / count),
          with(R * light.half_v, part), with(R * light.direction, 0)};
}

void require_shadow_maps(const Lighting& lighting) {
  if (!lighting.shadows) return;
  if (!lighting.areas.empty()) {
    throw UserError(
        "gl: the shadows of renderer.lighting.areas are not supported by shadow maps; use engine: raycast, or "
        "shadows: false");
  }
}

}  // namespace

GlGloss::GlGloss(const Lighting& lighting, GlScene& scene)
    : environment_(lighting.environment), visible_(lighting.environment_visible) {
  require_shadow_maps(lighting);
  std::vector<float> values;
  for (const auto& [scale, offset] : SplitSum::table().values()) values.insert(values.end(), {scale, offset});
  if (environment_ != nullptr) {
    const std::size_t first = values.size();
    const auto add = [&](const OctahedralLayout& map) {
      maps_.insert(maps_.end(), {map.size, static_cast<GLint>(first + map.offset)});
    };
    add(environment_->diffuse_map());
    for (const OctahedralLayout& level : environment_->levels()) add(level);
    values.insert(values.end(), environment_->values().begin(), environment_->values().end());
  }
  glCreateBuffers(1, &surroundings_);
  glNamedBufferStorage(surroundings_, static_cast<GLsizeiptr>(values.size() * sizeof(float)), values.data(), 0);
  glCreateBuffers(1, &areas_);
  if (!visible_) return;
  sky_ = scene.texture(environment_->sky(0).get());
  sky_program_ = make_program({kWholeImageVertexShader}, {kMeanShader, kSkyFragmentShader});
}

void GlGloss::upload(const Lighting& lighting, const SE3& T_camera_world) {
  T_camera_world_ = T_camera_world;
  std::vector<ShaderArea> areas;
  for (const AreaLight& light : lighting.areas) areas.push_back(in_camera_frame(light, T_camera_world));
  area_count_ = static_cast<int>(areas.size());
  areas.resize(std::max<std::size_t>(areas.size(), 1));
  glNamedBufferData(areas_, static_cast<GLsizeiptr>(areas.size() * sizeof(ShaderArea)), areas.data(), GL_STREAM_DRAW);
}

void GlGloss::bind_to(GLuint program) const {
  glBindBufferBase(GL_SHADER_STORAGE_BUFFER, kAreasBinding, areas_);
  glBindBufferBase(GL_SHADER_STORAGE_BUFFER, kSurroundingsBinding, surroundings_);
  set(program, "area_count", area_count_);
  set(program, "has_environment", static_cast<int>(environment_ != nullptr));
  if (environment_ == nullptr) return;
  glUniform2iv(location(program, "maps"), static_cast<GLsizei>(maps_.size() / 2), maps_.data());
  const Eigen::Matrix3f R = T_camera_world_.rotation.conjugate().toRotationMatrix().cast<float>();
  glUniformMatrix3fv(location(program, "world_from_view"), 1, GL_FALSE, R.data());
}

void GlGloss::bind_part(GLuint program, const GlScene::Part& part) const {
  static const Gloss kMatte;
  const Gloss& gloss = part.gloss != nullptr ? *part.gloss : kMatte;
  for (std::size_t i = 0; i < part.gloss_textures.size(); ++i)
    glBindTextureUnit(kGlossTextures + static_cast<GLuint>(i), part.gloss_textures[i]);
  set(program, "has_metallic_texture", static_cast<int>(part.gloss_textures[0] != 0));
  set(program, "has_roughness_texture", static_cast<int>(part.gloss_textures[1] != 0));
  set(program, "has_normal_textures", static_cast<int>(part.gloss_textures[2] != 0));
  set(program, "metallic", gloss.metallic);
  set(program, "roughness", gloss.roughness);
  set(program, "reflectance", gloss.reflectance);
  set(program, "edge_reflectance", gloss.edge_reflectance);
}

void GlGloss::draw_sky(const PinholeView& view, GLuint no_vertices) const {
  if (!visible_) return;
  glUseProgram(sky_program_);
  glBindTextureUnit(kSkyTexture, sky_);
  const Eigen::Matrix3f R = (Eigen::AngleAxisd(-environment_->rotation_rad(), Eigen::Vector3d::UnitZ()) *
                             T_camera_world_.rotation.conjugate())
                                .toRotationMatrix()
                                .cast<float>();
  glUniformMatrix3fv(location(sky_program_, "image_from_camera"), 1, GL_FALSE, R.data());
  const auto f = [](double value) { return static_cast<float>(value); };
  glUniform4f(location(sky_program_, "pinhole"), f(view.fx), f(view.fy), f(view.cx), f(view.cy));
  glBindVertexArray(no_vertices);
  glDrawArrays(GL_TRIANGLES, 0, 3);
}

}  // namespace esim::inline backends::inline opengl
