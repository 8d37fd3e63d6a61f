#pragma once

#include <epoxy/gl.h>

#include <array>
#include <map>
#include <memory>
#include <vector>

#include "esim/backends/opengl/gl_deforming.h"
#include "esim/scene/scene.h"

// Private to backends/opengl: includes epoxy/gl.h.
namespace esim::inline backends::inline opengl {

/// A scene in the device memory of the current context.
class GlScene {
 public:
  explicit GlScene(const Scene& scene);

  /// Triangles of one object and one material.
  struct Part {
    GLint first;
    GLsizei count;                          // vertices
    GLuint base_texture, emission_texture;  // 0: none
    float base, emission;
    bool unlit;
    std::shared_ptr<const Gloss> gloss;    // null: Gloss()
    std::array<GLuint, 5> gloss_textures;  // metallic, roughness, and the three of normals; 0: none
  };
  struct Object {
    bool moves;
    std::vector<Part> parts;

    /// The number of its vertices before a part.
    GLint before(const Part& part) const { return part.first - parts.front().first; }
  };

  const std::vector<Object>& objects() const { return objects_; }
  GLuint vertices() const { return vertex_array_; }

  /// Those that deform.
  const std::vector<GlDeformingObject>& deforming() const { return deforming_; }

  /// Deforms the objects, and returns their vertices in the order of deforming().
  GlDeformed deform(TimeNs t);

  /// A texture of the scene, or another one that lives as long. 0 for null.
  GLuint texture(const Texture* texture);

 private:
  void add(const SceneObject& object, std::vector<GlVertex>& vertices);
  void upload(const std::vector<GlVertex>& vertices);
  std::array<GLuint, 5> gloss_textures(const Gloss* gloss);

  std::vector<Object> objects_;
  std::size_t moving_ = 0;
  std::vector<GlDeformingObject> deforming_;
  std::map<const Texture*, GLuint> textures_;
  GLuint buffer_ = 0, vertex_array_ = 0;
};

}  // namespace esim::inline backends::inline opengl
