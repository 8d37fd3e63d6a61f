#include "esim/backends/opengl/splats/gl_splat_scene.h"

#include <fmt/format.h>

#include <Eigen/Core>
#include <algorithm>
#include <bit>
#include <cstdint>
#include <utility>

#include "esim/backends/opengl/gl_context.h"
#include "esim/backends/opengl/gl_program.h"
#include "esim/backends/opengl/splats/gl_splat_shaders.h"
#include "esim/core/error.h"
#include "esim/geometry/se3.h"
#include "esim/scene/splats/splat_rules.h"

namespace esim::inline backends::inline opengl {
namespace {

constexpr std::size_t kFloats = 16;  // per splat: as the shader reads them

template <typename T>
GlBuffer buffer_of(const std::vector<T>& values) {
  GlBuffer buffer(GL_DYNAMIC_STORAGE_BIT);
  buffer.make_room(values.size() * sizeof(T));
  glNamedBufferSubData(buffer.name(), 0, static_cast<GLsizeiptr>(values.size() * sizeof(T)), values.data());
  return buffer;
}

GlBuffer upload_shapes(const Splats& splats) {
  require_gl_items(splats.size(), kFloats * sizeof(float));
  std::vector<float> values(splats.size() * kFloats);
  for (std::size_t i = 0; i < splats.size(); ++i) {
    const Eigen::Vector3f &p = splats.positions[i], &deviations = splats.deviations[i];
    const Eigen::Vector4f& q = splats.rotations[i];
    const Eigen::Matrix3f R = Eigen::Quaternionf(q[3], q[0], q[1], q[2]).normalized().toRotationMatrix();
    float* to = &values[i * kFloats];
    std::copy_n(p.data(), 3, to), to[3] = splats.opacities[i];
    for (int axis = 0; axis < 3; ++axis) {
      to += 4;
      for (int k = 0; k < 3; ++k) to[k] = R(k, axis) * deviations[axis];
      const float harmonic = splats.harmonics[i * splats.coefficients() * 3 + static_cast<std::size_t>(axis)];
      to[3] = 0.5F + kHarmonic0 * harmonic;  // a colour, without the other harmonics
    }
  }
  return buffer_of(values);
}

/// Two halves in each number; those of a coefficient are next to those of the other splats.
GlBuffer upload_harmonics(const Splats& splats) {
  const std::size_t halves = (splats.coefficients() - 1) * 3, words = (halves + 1) / 2, size = splats.size();
  require_gl_items(size, words * sizeof(std::uint32_t));
  std::vector<std::uint32_t> values(words * size);
  for (std::size_t i = 0; i < size; ++i) {
    for (std::size_t h = 0; h < halves; ++h) {
      constexpr float kLargest = 65504;
      const float value = std::clamp(splats.harmonics[i * (halves + 3) + 3 + h], -kLargest, kLargest);
      const std::uint32_t bits = std::bit_cast<std::uint16_t>(Eigen::half(value));
      values[h / 2 * size + i] |= bits << (16 * (h % 2));
    }
  }
  return buffer_of(values);
}

void set(GLuint program, const char* name, const Eigen::Vector3f& value) {
  glUniform3fv(location(program, name), 1, value.data());
}

}  // namespace

std::size_t max_gl_items(std::size_t bytes_each) {
  GLint64 most_bytes = 0;
  glGetInteger64v(GL_MAX_SHADER_STORAGE_BLOCK_SIZE, &most_bytes);
  GLint groups = 0;
  glGetIntegeri_v(GL_MAX_COMPUTE_WORK_GROUP_COUNT, 0, &groups);
  constexpr std::size_t kMost = 0x7fffffff;  // since shaders count in 32 bits
  const std::size_t invocations = std::min(kMost, static_cast<std::size_t>(groups) * kGlGroup);
  return std::min(invocations, static_cast<std::size_t>(most_bytes) / std::max<std::size_t>(bytes_each, 1));
}

void require_gl_items(std::size_t items, std::size_t bytes_each) {
  const std::size_t most = max_gl_items(bytes_each);
  if (items <= most) return;
  throw UserError(
      fmt::format("gl: the device supports at most {} splats, counted once for each square of 16 x 16 pixels that they "
                  "touch, not {}; use engine: processor",
                  most, items));
}

GlSplatScene::GlSplatScene(const std::vector<SplatObject>& objects) {
  std::size_t size = 0;
  for (const SplatObject& object : objects) {
    const Splats& splats = *object.splats;
    objects_.push_back({upload_shapes(splats), upload_harmonics(splats), static_cast<GLuint>(size),
                        static_cast<GLuint>(splats.size()), splats.degree, splats.filter,
                        object.moving ? *object.moving + 1 : 0, splats.to_object});
    size += splats.size();
    require_gl_items(size, kFloats * sizeof(float));  // of the results, too
  }
  size_ = static_cast<GLuint>(size);
  throw_on_gl_error("uploading splats");
}

void GlSplatScene::project(GLuint program, const RenderRequest& request, float pixel_area) const {
  glUseProgram(program);
  for (const Object& object : objects_) {
    SE3 T_splats_camera = request.camera.T_world_body;
    if (object.number > 0)
      T_splats_camera = request.objects[object.number - 1].T_world_body.inverse() * T_splats_camera;
    T_splats_camera = SE3{object.to_object.conjugate(), Eigen::Vector3d::Zero()} * T_splats_camera;
    // The sum of two positions, since floats are too coarse for slow motion
    const Eigen::Vector3f position = T_splats_camera.translation.cast<float>();
    set(program, "position", position);
    set(program, "position_remainder",
        Eigen::Vector3f((T_splats_camera.translation - position.cast<double>()).cast<float>()));
    const Eigen::Matrix3f R = T_splats_camera.rotation.toRotationMatrix().transpose().cast<float>();
    glUniformMatrix3fv(location(program, "R_camera_group"), 1, GL_FALSE, R.data());
    set(program, "first", object.first);
    set(program, "count", object.count);
    set(program, "degree", object.degree);
    set(program, "object", static_cast<float>(object.number));
    set(program, "variance", variance_of(object.filter) * pixel_area);
    set(program, "compensated", static_cast<int>(object.filter != SplatFilter::dilated));
    object.splats.bind(kSplats);
    object.harmonics.bind(kHarmonics);
    glDispatchCompute((object.count + kGlGroup - 1) / kGlGroup, 1, 1);
  }
}

}  // namespace esim::inline backends::inline opengl
