#pragma once

#include <vector>

#include "esim/scene/import/gltf/gltf_document.h"
#include "esim/scene/import/scene_graph.h"

// Private to scene: includes nlohmann/json.hpp.
namespace esim::inline scene {

/// Reads the animations of a glTF file into the tracks of a graph's nodes; `node_of` gives the node of the graph, or
/// -1, for each of the file. All animations play at the same time, since Blender exports one per object. If one moves
/// what an earlier one moves, it is left out, with a warning. With a `name`, those with this name play, and there must
/// be one.
void read_gltf_animations(const GltfDocument& document, const std::vector<int>& node_of, const std::string& name,
                          SceneGraph& graph);

}  // namespace esim::inline scene
