#include "esim/backends/opengl/gl_scene.h"

#include <algorithm>
#include <bit>
#include <cstddef>
#include <numeric>
#include <string>

#include "esim/backends/opengl/gl_context.h"
#include "esim/backends/opengl/gl_shaders.h"
#include "esim/core/error.h"

namespace esim::inline backends::inline opengl {

GlScene::GlScene(const Scene& scene) {
  std::vector<GlVertex> vertices;
  for (const SceneObject& object : scene.objects) add(object, vertices);
  upload(vertices);
  throw_on_gl_error("uploading the scene");
}

void GlScene::add(const SceneObject& object, std::vector<GlVertex>& vertices) {
  const Mesh& mesh = object.mesh;
  std::vector<std::uint32_t> order(mesh.triangles.size());
  std::iota(order.begin(), order.end(), 0U);
  std::stable_sort(order.begin(), order.end(), [&](auto a, auto b) { return mesh.material[a] < mesh.material[b]; });

  const std::size_t first = vertices.size();
  Object added{object.moves, {}};
  if (object.moves) ++moving_;
  for (std::size_t i = 0; i < order.size(); ++i) {
    const std::uint32_t triangle = order[i], material_index = mesh.material[triangle];
    if (i == 0 || material_index != mesh.material[order[i - 1]]) {
      const Material& material = mesh.materials[material_index];
      added.parts.push_back({static_cast<GLint>(vertices.size()), 0, texture(material.texture.get()),
                             texture(material.emission_texture.get()), material.base, material.emission, material.unlit,
                             material.gloss, gloss_textures(material.gloss.get())});
    }
    for (std::size_t corner = 0; corner < 3; ++corner) {
      const std::uint32_t vertex = mesh.triangles[triangle][corner];
      const Eigen::Vector3f normal =
          mesh.normals.empty() ? Eigen::Vector3f(Eigen::Vector3f::Zero()) : mesh.normals[vertex];
      vertices.push_back({mesh.vertices[vertex], normal, mesh.texture_uv[triangle][corner]});
    }
    added.parts.back().count += 3;
  }
  objects_.push_back(std::move(added));
  if (object.deformation == nullptr) return;
  std::vector<GlVertex> own(vertices.begin() + static_cast<std::ptrdiff_t>(first), vertices.end());
  deforming_.emplace_back(object, std::move(order), first, std::move(own), moving_);
}

GlDeformed GlScene::deform(TimeNs t) {
  GlDeformed deformed;
  for (GlDeformingObject& object : deforming_) {
    object.deform(t, buffer_);
    deformed.push_back(object.vertices());
  }
  return deformed;
}

void GlScene::upload(const std::vector<GlVertex>& vertices) {
  glCreateBuffers(1, &buffer_);
  glNamedBufferStorage(buffer_, static_cast<GLsizeiptr>(vertices.size() * sizeof(GlVertex)), vertices.data(),
                       deforming_.empty() ? 0 : GL_DYNAMIC_STORAGE_BIT);
  glCreateVertexArrays(1, &vertex_array_);
  glVertexArrayVertexBuffer(vertex_array_, 0, buffer_, 0, sizeof(GlVertex));
  const auto attribute = [&](GLuint name, GLint size, std::size_t offset) {
    glEnableVertexArrayAttrib(vertex_array_, name);
    glVertexArrayAttribFormat(vertex_array_, name, size, GL_FLOAT, GL_FALSE, static_cast<GLuint>(offset));
    glVertexArrayAttribBinding(vertex_array_, name, 0);
  };
  attribute(kPosition, 3, offsetof(GlVertex, position));
  attribute(kNormal, 3, offsetof(GlVertex, normal));
  attribute(kTextureUv, 2, offsetof(GlVertex, texture_uv));
}

std::array<GLuint, 5> GlScene::gloss_textures(const Gloss* gloss) {
  if (gloss == nullptr) return {};
  return {texture(gloss->metallic_texture.get()), texture(gloss->roughness_texture.get()),
          texture(gloss->normal_textures[0].get()), texture(gloss->normal_textures[1].get()),
          texture(gloss->normal_textures[2].get())};
}

/// With a mip pyramid, for the mean over a pixel's footprint.
GLuint GlScene::texture(const Texture* texture) {
  if (texture == nullptr) return 0;
  const auto [entry, is_new] = textures_.try_emplace(texture, 0U);
  if (!is_new) return entry->second;

  GLint largest = 0;
  glGetIntegerv(GL_MAX_TEXTURE_SIZE, &largest);
  if (texture->width() > largest || texture->height() > largest) {
    throw UserError("gl: a texture of " + std::to_string(texture->width()) + " x " + std::to_string(texture->height()) +
                    " texels is larger than the device's maximum of " + std::to_string(largest) +
                    "; scale it down, or use engine: raycast");
  }
  const Image<float> texels = texture->texels();
  GLuint& name = entry->second;
  glCreateTextures(GL_TEXTURE_2D, 1, &name);
  const auto levels =
      static_cast<GLsizei>(std::bit_width(static_cast<unsigned>(std::max(texture->width(), texture->height()))));
  glTextureStorage2D(name, levels, GL_R32F, texture->width(), texture->height());
  glTextureSubImage2D(name, 0, 0, 0, texture->width(), texture->height(), GL_RED, GL_FLOAT, texels.pixels().data());
  glGenerateTextureMipmap(name);
  const auto wrap = [](Wrap mode) { return mode == Wrap::repeat ? GL_REPEAT : GL_CLAMP_TO_EDGE; };
  glTextureParameteri(name, GL_TEXTURE_WRAP_S, wrap(texture->wrap_u()));
  glTextureParameteri(name, GL_TEXTURE_WRAP_T, wrap(texture->wrap_v()));
  glTextureParameteri(name, GL_TEXTURE_MIN_FILTER, GL_LINEAR_MIPMAP_NEAREST);  // the shader mixes levels itself
  glTextureParameteri(name, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
  return name;
}

}  // namespace esim::inline backends::inline opengl
