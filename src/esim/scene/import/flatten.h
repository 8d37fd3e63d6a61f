#pragma once

#include "esim/scene/import/scene_graph.h"
#include "esim/scene/scene_file.h"

namespace esim::inline scene {

/// Geometry, materials and motions of a graph. All static nodes become one object in the world's frame; every subtree
/// with an animated root becomes a separate object, without those of its subtrees that are animated themselves.
///
/// An animated node's transform M(t) is rigid up to a constant factor: M(t) = T(t) S, with T(t) the object's pose and
/// S = T(0)⁻¹ M(0) applied to its vertices. If M(t) is not, because its scale changes, the object rests in the world's
/// frame, and deforms. Meshes with moving joints, or with morph targets of varying weight, are objects of their own,
/// with the name of their node: with joints in the world's frame, otherwise in that of the animated node.
SceneFile flatten(const SceneGraph& graph, const std::filesystem::path& file, const WarningHandler& warn,
                  SceneLook look);

/// The complete graph as one object in the world's frame, which deforms if it `plays` and anything in it is animated.
/// Its shape is that at the start of the animation.
SceneObject flatten_joined(const SceneGraph& graph, const std::filesystem::path& file, const WarningHandler& warn,
                           SceneLook look, bool plays);

}  // namespace esim::inline scene
