#pragma once

#include <cstdint>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace esim::test {

/// Writes GLB files from their JSON: tests add arrays and get the indices of their accessors.
class GlbWriter {
 public:
  nlohmann::json json = {{"asset", {{"version", "2.0"}}},
                         {"scene", 0},
                         {"scenes", {{{"nodes", nlohmann::json::array()}}}},
                         {"nodes", nlohmann::json::array()},
                         {"bufferViews", nlohmann::json::array()},
                         {"accessors", nlohmann::json::array()}};

  std::size_t floats(const std::vector<float>& values, const std::string& type) {
    static const std::map<std::string, std::size_t> kComponents = {
        {"SCALAR", 1}, {"VEC2", 2}, {"VEC3", 3}, {"VEC4", 4}, {"MAT4", 16}};
    const std::size_t view = add_view(values.data(), values.size() * sizeof(float));
    return add_accessor(view, 5126, values.size() / kComponents.at(type), type);
  }

  std::size_t indices(const std::vector<std::uint16_t>& values) {
    return add_accessor(add_view(values.data(), values.size() * sizeof(std::uint16_t)), 5123, values.size(), "SCALAR");
  }

  /// Indices of joints, four per vertex.
  std::size_t joints(const std::vector<std::uint8_t>& values) {
    return add_accessor(add_view(values.data(), values.size()), 5121, values.size() / 4, "VEC4");
  }

  /// Vectors of which only some differ from zero.
  std::size_t sparse(std::size_t count, const std::vector<std::uint16_t>& places, const std::vector<float>& values) {
    const std::size_t indices = add_view(places.data(), places.size() * sizeof(std::uint16_t));
    const std::size_t replaced = add_view(values.data(), values.size() * sizeof(float));
    return add("accessors", {{"componentType", 5126},
                             {"count", count},
                             {"type", "VEC3"},
                             {"sparse",
                              {{"count", places.size()},
                               {"indices", {{"bufferView", indices}, {"componentType", 5123}}},
                               {"values", {{"bufferView", replaced}}}}}});
  }

  std::size_t add_view(const void* data, std::size_t size) {
    json["bufferViews"].push_back({{"buffer", 0}, {"byteOffset", binary_.size()}, {"byteLength", size}});
    binary_.append(static_cast<const char*>(data), size);
    binary_.resize((binary_.size() + 3) / 4 * 4);
    return json["bufferViews"].size() - 1;
  }

  /// A node at the top level of the scene.
  std::size_t add_node(nlohmann::json node) {
    json["nodes"].push_back(std::move(node));
    json["scenes"][0]["nodes"].push_back(json["nodes"].size() - 1);
    return json["nodes"].size() - 1;
  }

  std::size_t add(const char* list, nlohmann::json entry) {
    json[list].push_back(std::move(entry));
    return json[list].size() - 1;
  }

  /// A triangle (0 0 0), (1 0 0), (0 1 0) with texture coordinates.
  std::size_t add_triangle(nlohmann::json material = nullptr) {
    nlohmann::json primitive = {{"attributes",
                                 {{"POSITION", floats({0, 0, 0, 1, 0, 0, 0, 1, 0}, "VEC3")},
                                  {"TEXCOORD_0", floats({0, 0, 1, 0, 0, 1}, "VEC2")}}},
                                {"indices", indices({0, 1, 2})}};
    if (!material.is_null()) primitive["material"] = material;
    return add("meshes", {{"name", "triangle"}, {"primitives", {primitive}}});
  }

  void animate(std::size_t node, const char* path, const std::vector<float>& times, const std::vector<float>& values,
               const char* interpolation = "LINEAR") {
    const char* const type = std::string(path) == "rotation"  ? "VEC4"
                             : std::string(path) == "weights" ? "SCALAR"
                                                              : "VEC3";
    const auto input = floats(times, "SCALAR"), output = floats(values, type);
    add("animations", {{"samplers", {{{"input", input}, {"output", output}, {"interpolation", interpolation}}}},
                       {"channels", {{{"sampler", 0}, {"target", {{"node", node}, {"path", path}}}}}}});
  }

  std::string bytes() const {
    nlohmann::json whole = json;
    whole["buffers"] = {{{"byteLength", binary_.size()}}};
    std::string text = whole.dump();
    text.resize((text.size() + 3) / 4 * 4, ' ');
    const auto word = [](std::uint32_t value) { return std::string(reinterpret_cast<const char*>(&value), 4); };
    const auto size = [](const std::string& of) { return static_cast<std::uint32_t>(of.size()); };
    return "glTF" + word(2) + word(28 + size(text) + size(binary_)) + word(size(text)) + "JSON" + text +
           word(size(binary_)) + std::string("BIN\0", 4) + binary_;
  }

 private:
  std::size_t add_accessor(std::size_t view, int component, std::size_t count, const std::string& type) {
    return add("accessors", {{"bufferView", view}, {"componentType", component}, {"count", count}, {"type", type}});
  }

  std::string binary_;
};

}  // namespace esim::test
