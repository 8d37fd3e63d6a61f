#pragma once

#include <epoxy/gl.h>

#include <map>
#include <vector>

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
  };
  struct Object {
    bool moves;
    std::vector<Part> parts;
  };

  const std::vector<Object>& objects() const { return objects_; }
  GLuint vertices() const { return vertex_array_; }

 private:
  struct Vertex;
  void add(const SceneObject& object, std::vector<Vertex>& vertices);
  void upload(const std::vector<Vertex>& vertices);
  GLuint texture(const Texture* texture);

  std::vector<Object> objects_;
  std::map<const Texture*, GLuint> textures_;
  GLuint vertex_array_ = 0;
};

}  // namespace esim::inline backends::inline opengl
