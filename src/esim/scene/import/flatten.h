#pragma once

#include "esim/scene/import/scene_graph.h"
#include "esim/scene/scene_file.h"

namespace esim::inline scene {

/// Geometry, materials and motions of a graph. All static nodes become one object in the world's frame; every subtree
/// with an animated root becomes a separate object, without those of its subtrees that are animated themselves.
///
/// An animated node's transform M(t) is rigid up to a constant factor: M(t) = T(t) S, with T(t) the object's pose and
/// S = T(0)⁻¹ M(0) applied to its vertices. If the scale is animated too, its first value is kept, with a warning.
SceneFile flatten(const SceneGraph& graph, const std::filesystem::path& file, const WarningHandler& warn,
                  SceneLook look, SurfaceModel model);

/// The complete graph as one static mesh, as at the start of its animation.
Mesh flatten_still(const SceneGraph& graph, const std::filesystem::path& file, const WarningHandler& warn,
                   SceneLook look, SurfaceModel model);

}  // namespace esim::inline scene
