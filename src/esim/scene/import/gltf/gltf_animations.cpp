#include "esim/scene/import/gltf/gltf_animations.h"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <set>
#include <utility>

#include "esim/files/number_text.h"

namespace esim::inline scene {
namespace {

using Json = GltfDocument::Json;

class AnimationReader {
 public:
  AnimationReader(const GltfDocument& document, const std::vector<int>& node_of, SceneGraph& graph)
      : document_(document), node_of_(node_of), graph_(graph) {}

  /// Of those with this name; empty: of all.
  void read(const std::string& name) {
    const Json& animations = document_.list("animations");
    std::vector<std::string> names;
    for (std::size_t i = 0; i < animations.size(); ++i)
      names.push_back(document_.text(animations[i], "name", std::to_string(i)));
    const std::set<std::string> distinct(names.begin(), names.end());
    if (!name.empty() && !distinct.contains(name)) {
      document_.fail(fmt::format("has no animation {}; it has {}", name,
                                 distinct.empty() ? "none" : list_of_some({distinct.begin(), distinct.end()})));
    }
    for (std::size_t i = 0; i < animations.size(); ++i) {
      if (!name.empty() && names[i] != name) continue;
      const std::vector<Channel> channels = channels_of(animations[i]);
      const auto known = [&](const Channel& channel) { return moved_.contains({channel.node, channel.path}); };
      if (std::any_of(channels.begin(), channels.end(), known)) {
        graph_.warnings.push_back(fmt::format(
            "animation {}: moves what an earlier animation moves, and is not played; an entry of objects can "
            "choose it with animation.name",
            names[i]));
        continue;
      }
      for (const Channel& channel : channels) {
        moved_.insert({channel.node, channel.path});
        animate(graph_.nodes[channel.node], channel);
      }
    }
  }

 private:
  struct Channel {
    std::size_t node = 0;  // of the graph
    std::string path;
    const Json* sampler = nullptr;
  };

  std::vector<Channel> channels_of(const Json& animation) const {
    std::vector<Channel> result;
    const Json* const channels = GltfDocument::find(animation, "channels");
    const Json* const samplers = GltfDocument::find(animation, "samplers");
    if (channels == nullptr || samplers == nullptr || !samplers->is_array()) return result;
    for (const Json& channel : *channels) {
      const Json* const target = GltfDocument::find(channel, "target");
      if (target == nullptr || !document_.has_index(*target, "node")) continue;
      const int node = node_of_[document_.index(*target, "node", "nodes")];
      const double sampler = document_.number(channel, "sampler", -1);
      if (!(sampler >= 0 && sampler < static_cast<double>(samplers->size())))
        document_.fail("is damaged: an animation refers to a missing sampler");
      if (node >= 0)
        result.push_back({static_cast<std::size_t>(node), document_.text(*target, "path"),
                          &(*samplers)[static_cast<std::size_t>(sampler)]});
    }
    return result;
  }

  void animate(GraphNode& node, const Channel& channel) {
    const std::string& path = channel.path;
    if (path == "weights") {
      animate_weights(node, *channel.sampler);
    } else if (path == "translation" || path == "rotation" || path == "scale") {
      if (node.matrix) document_.fail(fmt::format("is damaged: node {} has a matrix, but is animated", node.name));
      Track& slot = path == "translation" ? node.translation_track
                    : path == "rotation"  ? node.rotation_track
                                          : node.scale_track;
      slot = track(*channel.sampler, path == "rotation" ? 4 : 3);
    }
  }

  void animate_weights(GraphNode& node, const Json& sampler) {
    const std::size_t targets = node.meshes.empty() ? 0 : graph_.shapes[node.meshes.front()].targets.size();
    if (targets == 0) {
      graph_.warnings.push_back(
          fmt::format("object {}: an animation of morph targets has no effect, since its mesh has none", node.name));
      return;
    }
    Keys keys = read_keys(sampler, 1, targets);
    node.weight_track = {keys.interpolation, std::move(keys.times_s), std::move(keys.values)};
  }

  Track track(const Json& sampler, std::size_t components) {
    Keys keys = read_keys(sampler, components, 1);
    Track track{keys.interpolation, std::move(keys.times_s), {}};
    for (std::size_t i = 0; i < keys.values.size(); i += components) {
      Eigen::Vector4d value = Eigen::Vector4d::UnitW();
      for (std::size_t c = 0; c < components; ++c) value[static_cast<Eigen::Index>(c)] = keys.values[i + c];
      if (components == 3) value[3] = 0;
      track.values.push_back(value);
    }
    return track;
  }

  struct Keys {
    Interpolation interpolation = Interpolation::linear;
    std::vector<double> times_s;
    std::vector<float> values;
  };

  /// The keys of a sampler, whose values are `elements` elements of `components` numbers.
  Keys read_keys(const Json& sampler, std::size_t components, std::size_t elements) {
    Keys keys;
    const std::string mode = document_.text(sampler, "interpolation", "LINEAR");
    if (mode == "STEP") keys.interpolation = Interpolation::step;
    if (mode == "CUBICSPLINE") keys.interpolation = Interpolation::cubic;
    const auto times = document_.floats(document_.index(sampler, "input", "accessors"), 1);
    keys.values = document_.floats(document_.index(sampler, "output", "accessors"), components);
    const std::size_t per_time = keys.interpolation == Interpolation::cubic ? 3 : 1;
    key_count_ += times.size();
    if (key_count_ > kMaxSceneKeys) document_.fail(fmt::format("has more than {} animation keys", kMaxSceneKeys));
    if (times.empty() || keys.values.size() != times.size() * per_time * components * elements)
      document_.fail("is damaged: an animation must have one value per time");
    keys.times_s.assign(times.begin(), times.end());
    if (std::adjacent_find(times.begin(), times.end(), std::greater_equal<>()) != times.end() || times.front() < 0 ||
        times.back() > 1e6F)
      document_.fail("is damaged: the times of an animation must increase, from 0 or later");
    return keys;
  }

  const GltfDocument& document_;
  const std::vector<int>& node_of_;
  SceneGraph& graph_;
  std::set<std::pair<std::size_t, std::string>> moved_;
  std::size_t key_count_ = 0;
};

}  // namespace

void read_gltf_animations(const GltfDocument& document, const std::vector<int>& node_of, const std::string& name,
                          SceneGraph& graph) {
  AnimationReader(document, node_of, graph).read(name);
}

}  // namespace esim::inline scene
