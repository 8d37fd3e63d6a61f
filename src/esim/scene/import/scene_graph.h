#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "esim/core/error.h"
#include "esim/scene/deformation/morph_target.h"
#include "esim/scene/deformation/skin_weights.h"
#include "esim/scene/import/track.h"
#include "esim/scene/mesh.h"

/// The result of every reader of scene files: a tree of nodes, from which a Scene is made. The world's z axis points
/// up; lengths are in metres.
namespace esim::inline scene {

struct GraphNode {
  std::string name;
  int parent = -1;                          ///< index; parents precede their children
  std::optional<Eigen::Matrix4d> matrix{};  ///< instead of the following three, if none is animated
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  Eigen::Vector3d scale = Eigen::Vector3d::Ones();
  Track translation_track{}, rotation_track{}, scale_track{};
  std::vector<std::uint32_t> meshes{};
  int skin = -1;                 ///< index; -1: none. With a skin, its joints place the meshes, not the node
  std::vector<float> weights{};  ///< of the morph targets; empty: those of the mesh
  WeightTrack weight_track{};
};

/// The transform from the node's frame to its parent's.
Eigen::Matrix4d local_transform(const GraphNode& node, double t_s);

/// A transform, and its time derivative per second.
struct MovingTransform {
  Eigen::Matrix4d value = Eigen::Matrix4d::Identity(), slope = Eigen::Matrix4d::Zero();
};

/// As local_transform(), with the derivative.
MovingTransform moving_local_transform(const GraphNode& node, double t_s);

/// How a mesh may deform: first by morph targets, then by joints.
struct GraphShape {
  std::vector<std::shared_ptr<const MorphTarget>> targets;
  std::vector<float> weights;  ///< of the targets
  SkinWeights skin;            ///< empty: the mesh has no influences of joints
};

struct GraphSkin {
  std::string name;
  std::vector<std::uint32_t> joints;          ///< nodes
  std::vector<Eigen::Matrix4d> inverse_bind;  ///< per joint: from the mesh's frame to the joint's, at rest
};

/// An image of materials: a file that the scene refers to, or embedded bytes.
struct GraphImage {
  std::string name;  ///< of the file, relative to the scene's folder; only for messages if there are bytes
  std::vector<std::byte> bytes;
};

struct GraphTexture {
  std::int32_t image = -1;  ///< -1: no image
  Wrap wrap_u = Wrap::repeat, wrap_v = Wrap::repeat;
};

/// Colours are linear; texels are multiplied by them.
struct GraphMaterial {
  std::string name;
  Eigen::Vector3f base = Eigen::Vector3f::Constant(0.5F);
  GraphTexture base_texture{};
  Eigen::Vector3f emission = Eigen::Vector3f::Zero();
  GraphTexture emission_texture{};
  bool unlit = false;

  // As in Gloss. A roughness is in the texture's green channel, a metallic factor in its blue one.
  float metallic = 0, roughness = 1, reflectance = 0.04F, edge_reflectance = 1;
  GraphTexture metallic_texture{}, roughness_texture{};
  GraphTexture normal_texture{};
  float normal_scale = 1;
};

struct GraphCamera {
  std::string name;
  std::uint32_t node = 0;
  double horizontal_fov_rad = 0;                                ///< 0: unknown
  Eigen::Matrix4d T_node_camera = Eigen::Matrix4d::Identity();  ///< of the camera frame: x right, y down, z forward
};

struct SceneGraph {
  std::vector<GraphNode> nodes;
  std::vector<Mesh> meshes;        ///< in the frames of their nodes; `material` indexes the materials below
  std::vector<GraphShape> shapes;  ///< per mesh; empty if the format has none
  std::vector<GraphSkin> skins;
  std::vector<GraphMaterial> materials;
  std::vector<GraphImage> images;
  std::vector<GraphCamera> cameras;
  bool ignores_alpha = false;  ///< whether surfaces of the format are opaque by default
  int relief = 0;              ///< number of materials with a normal map or a bump map
  int bump_maps = 0;           ///< of which this number has only heights, which are not supported
  std::vector<std::string> warnings;
  std::vector<std::string> gloss_warnings;  ///< of what matters only if surfaces shine
  std::vector<std::string> files;           ///< that another process opened to read the scene

  /// Per mesh and vertex: which vertex of the file it is, from 0; only of read_numbered_with_assimp().
  std::vector<std::vector<std::uint32_t>> vertex_numbers;
};

/// Limits of a scene, so that a small file cannot request gigabytes.
inline constexpr std::size_t kMaxSceneTriangles = std::size_t{1} << 24;
inline constexpr std::size_t kMaxSceneVertices = std::size_t{1} << 25;
inline constexpr std::size_t kMaxSceneMorphs = std::size_t{1} << 27;  ///< targets times vertices
inline constexpr std::size_t kMaxSceneTexels = std::size_t{1} << 28;
inline constexpr std::size_t kMaxElementsWithoutData = std::size_t{1} << 22;  ///< that a file states to be zero
inline constexpr std::size_t kMaxSceneKeys = std::size_t{1} << 22;

/// Throws the UserError "scene FILE: REASON".
[[noreturn]] void fail_scene(const std::filesystem::path& file, const std::string& reason);

// The readers, one per file of this folder. They throw UserError for files that cannot be read, and warn of features
// that are ignored. They check all indices and reject numbers that are not finite.

/// glTF 2.0: .gltf and .glb.
/// `animation`: the name of the one that is played; empty: all.
SceneGraph read_gltf(const std::filesystem::path& file, const std::string& animation = {});

/// The formats that assimp reads: OBJ, PLY, STL, FBX, Collada.
SceneGraph read_with_assimp(const std::filesystem::path& file);

/// The same for OBJ and PLY, with the numbers of the vertices in the file. These are split: in OBJ, each corner of a
/// face has a vertex of its own.
SceneGraph read_numbered_with_assimp(const std::filesystem::path& file);

}  // namespace esim::inline scene
