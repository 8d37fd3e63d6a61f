#pragma once

#include <string>
#include <string_view>

#include "esim/scene/import/scene_graph.h"

namespace esim::inline scene {

/// A graph as bytes, for transfer to another process of the same program.
std::string to_bytes(const SceneGraph& graph);

/// Throws InternalError for bytes that are not a graph.
SceneGraph graph_from_bytes(std::string_view bytes);

}  // namespace esim::inline scene
