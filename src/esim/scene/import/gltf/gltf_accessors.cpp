#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "esim/core/load_unaligned.h"
#include "esim/scene/import/gltf/gltf_document.h"
#include "esim/scene/import/scene_graph.h"

namespace esim::inline scene {
namespace {

using Json = GltfDocument::Json;

enum ComponentType { kByte = 5120, kUnsignedByte, kShort, kUnsignedShort, kUnsignedInt = 5125, kFloat };

std::size_t component_bytes(int type) {
  switch (type) {
    case kByte:
    case kUnsignedByte:
      return 1;
    case kShort:
    case kUnsignedShort:
      return 2;
    case kUnsignedInt:
    case kFloat:
      return 4;
    default:
      return 0;
  }
}

std::size_t component_count(const std::string& type) {
  static constexpr std::array<std::pair<const char*, std::size_t>, 7> kTypes{
      {{"SCALAR", 1}, {"VEC2", 2}, {"VEC3", 3}, {"VEC4", 4}, {"MAT2", 4}, {"MAT3", 9}, {"MAT4", 16}}};
  for (const auto& [name, count] : kTypes) {
    if (type == name) return count;
  }
  return 0;
}

float as_float(const std::byte* from, int type) {
  switch (type) {
    case kByte:
      return std::max(static_cast<float>(load_unaligned<std::int8_t>(from)) / 127.0F, -1.0F);
    case kUnsignedByte:
      return static_cast<float>(load_unaligned<std::uint8_t>(from)) / 255.0F;
    case kShort:
      return std::max(static_cast<float>(load_unaligned<std::int16_t>(from)) / 32767.0F, -1.0F);
    case kUnsignedShort:
      return static_cast<float>(load_unaligned<std::uint16_t>(from)) / 65535.0F;
    default:
      return load_unaligned<float>(from);
  }
}

float as_integer(const std::byte* from, int type) {
  switch (type) {
    case kByte:
      return static_cast<float>(load_unaligned<std::int8_t>(from));
    case kUnsignedByte:
      return static_cast<float>(load_unaligned<std::uint8_t>(from));
    case kShort:
      return static_cast<float>(load_unaligned<std::int16_t>(from));
    case kUnsignedShort:
      return static_cast<float>(load_unaligned<std::uint16_t>(from));
    default:
      return static_cast<float>(load_unaligned<std::uint32_t>(from));
  }
}

std::uint32_t as_index(const std::byte* from, int type) {
  switch (type) {
    case kUnsignedByte:
      return load_unaligned<std::uint8_t>(from);
    case kUnsignedShort:
      return load_unaligned<std::uint16_t>(from);
    default:
      return load_unaligned<std::uint32_t>(from);
  }
}

bool is_index(int type) { return type == kUnsignedByte || type == kUnsignedShort || type == kUnsignedInt; }

}  // namespace

std::size_t GltfDocument::components_of(std::size_t index_of_accessor) const {
  return component_count(text(list("accessors")[index_of_accessor], "type"));
}

GltfDocument::Accessor GltfDocument::located(const Json& json, std::size_t count, std::size_t element_bytes,
                                             const std::string& what) const {
  Accessor result;
  result.count = count;
  const std::size_t view = index(json, "bufferView", "bufferViews");
  const std::size_t stride = whole(list("bufferViews")[view], "byteStride", 0);
  result.stride = stride == 0 ? element_bytes : stride;
  result.bytes = buffer_view(view);
  const std::size_t offset = whole(json, "byteOffset", 0);
  const bool fits = offset <= result.bytes.size() && result.stride >= element_bytes &&
                    (count == 0 || (result.bytes.size() - offset >= element_bytes &&
                                    count - 1 <= (result.bytes.size() - offset - element_bytes) / result.stride));
  if (!fits) fail(fmt::format("is damaged: {} is beyond the end of its bufferView", what));
  result.bytes = result.bytes.subspan(offset);
  return result;
}

GltfDocument::Accessor GltfDocument::accessor(std::size_t index_of_accessor, std::size_t components) const {
  const Json& json = list("accessors")[index_of_accessor];
  const auto type = static_cast<int>(whole(json, "componentType", 0));
  const std::size_t element = component_bytes(type) * components, count = whole(json, "count", 0);
  if (element == 0 || component_count(text(json, "type")) != components)
    fail(fmt::format("is damaged: accessor {} has the wrong type for its use", index_of_accessor));
  Accessor result;
  if (has_index(json, "bufferView")) {
    result = located(json, count, element, fmt::format("accessor {}", index_of_accessor));
  } else {
    if (count > kMaxElementsWithoutData)
      fail(fmt::format("has {} elements without data in accessor {}; at most {} are supported", count,
                       index_of_accessor, kMaxElementsWithoutData));
    result.count = count;
  }
  result.component_type = type;
  result.normalised = flag(json, "normalized");
  return result;
}

template <typename T>
std::vector<T> GltfDocument::elements(std::size_t index_of_accessor, std::size_t components,
                                      T (*convert)(const std::byte*, int)) const {
  const Accessor from = accessor(index_of_accessor, components);
  const std::size_t step = component_bytes(from.component_type);
  std::vector<T> values(from.count * components);
  const auto store = [&](const std::byte* element, T* to) {
    for (std::size_t c = 0; c < components; ++c) to[c] = convert(element + c * step, from.component_type);
  };
  if (!from.bytes.empty()) {
    for (std::size_t i = 0; i < from.count; ++i) store(&from.bytes[i * from.stride], &values[i * components]);
  }
  const Json* const sparse = find(list("accessors")[index_of_accessor], "sparse");
  if (sparse == nullptr) return values;

  const Json *const indices = find(*sparse, "indices"), *const replacements = find(*sparse, "values");
  const std::size_t count = whole(*sparse, "count", 0);
  if (indices == nullptr || replacements == nullptr || count > from.count)
    fail(fmt::format("is damaged: the sparse elements of accessor {} are incomplete", index_of_accessor));
  const auto type = static_cast<int>(whole(*indices, "componentType", 0));
  const std::string what = fmt::format("a sparse part of accessor {}", index_of_accessor);
  if (!is_index(type)) fail(fmt::format("is damaged: {} does not contain indices", what));
  const Accessor places = located(*indices, count, component_bytes(type), what);
  const Accessor elements = located(*replacements, count, step * components, what);
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint32_t place = as_index(&places.bytes[i * places.stride], type);
    if (place >= from.count) fail(fmt::format("is damaged: {} refers to a missing element", what));
    store(&elements.bytes[i * elements.stride], &values[place * components]);
  }
  return values;
}

std::vector<float> GltfDocument::floats(std::size_t index_of_accessor, std::size_t components) const {
  const Accessor from = accessor(index_of_accessor, components);
  if (from.component_type != kFloat && !from.normalised)
    fail(fmt::format("is damaged: accessor {} contains integers instead of floats", index_of_accessor));
  return quantised_floats(index_of_accessor, components);
}

std::vector<float> GltfDocument::quantised_floats(std::size_t index_of_accessor, std::size_t components) const {
  std::vector<float> values = unchecked_floats(index_of_accessor, components);
  if (!std::all_of(values.begin(), values.end(), [](float value) { return std::isfinite(value); }))
    fail(fmt::format("accessor {} contains a number that is not finite", index_of_accessor));
  return values;
}

std::vector<float> GltfDocument::unchecked_floats(std::size_t index_of_accessor, std::size_t components) const {
  const Accessor from = accessor(index_of_accessor, components);
  return elements(index_of_accessor, components,
                  from.component_type == kFloat || from.normalised ? as_float : as_integer);
}

std::vector<std::uint32_t> GltfDocument::integers(std::size_t index_of_accessor, std::size_t components) const {
  const Accessor from = accessor(index_of_accessor, components);
  if (!is_index(from.component_type))
    fail(fmt::format("is damaged: accessor {} does not contain indices", index_of_accessor));
  return elements(index_of_accessor, components, as_index);
}

}  // namespace esim::inline scene
