#pragma once

#include <string>
#include <vector>

#include "esim/scene/import/gltf/gltf_document.h"
#include "esim/scene/import/scene_graph.h"

// Private to scene: includes nlohmann/json.hpp.
namespace esim::inline scene {

/// Reads how the meshes of a glTF file deform: skins and morph targets. Throws UserError for damaged data, and warns of
/// data from which it has to guess.
class GltfShapes {
 public:
  GltfShapes(const GltfDocument& document, std::vector<std::string>& warnings)
      : document_(document), warnings_(warnings) {}

  /// The vertices of a primitive in a mesh.
  struct Range {
    std::size_t first = 0, count = 0;
    bool has_normals = false;
  };

  /// Adds the influences and morph targets of a primitive to those of its mesh.
  void append(const GltfDocument::Json& primitive, const Range& range, const std::string& name, GraphShape& shape);

  /// Completes the shape of a mesh, after all of its primitives.
  void finish(const GltfDocument::Json& mesh, GraphShape& shape) const;

  /// A skin; `node_of` gives the node of the graph, or -1, for each of the file.
  GraphSkin skin(std::size_t index, const std::vector<int>& node_of) const;

  /// Checks that the skins of nodes have the joints to which their meshes refer.
  void check(const SceneGraph& graph) const;

 private:
  using Json = GltfDocument::Json;

  void append_targets(const Json& targets, const Range& range, const std::string& name, GraphShape& shape);
  MorphTarget target(const Json& json, const Range& range) const;
  void append_influences(const Json& attributes, const Range& range, const std::string& name, GraphShape& shape) const;

  const GltfDocument& document_;
  std::vector<std::string>& warnings_;
  std::size_t morph_count_ = 0;
};

}  // namespace esim::inline scene
