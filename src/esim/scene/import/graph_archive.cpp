#include "esim/scene/import/graph_archive.h"

#include <cstring>
#include <type_traits>

namespace esim::inline scene {
namespace {

// Every struct lists its members once, for reading and writing.

template <class Archive>
void archive(Archive& a, Track& o) {
  a(o.interpolation), a(o.times_s), a(o.values);
}

template <class Archive>
void archive(Archive& a, GraphNode& o) {
  a(o.name), a(o.parent), a(o.matrix), a(o.translation), a(o.rotation.coeffs()), a(o.scale);
  a(o.translation_track), a(o.rotation_track), a(o.scale_track), a(o.meshes);
}

template <class Archive>
void archive(Archive& a, Mesh& o) {
  a(o.vertices), a(o.normals), a(o.triangles), a(o.texture_uv), a(o.material);
}

template <class Archive>
void archive(Archive& a, GraphImage& o) {
  a(o.name), a(o.bytes);
}

template <class Archive>
void archive(Archive& a, GraphTexture& o) {
  a(o.image), a(o.wrap_u), a(o.wrap_v);
}

template <class Archive>
void archive(Archive& a, GraphMaterial& o) {
  a(o.name), a(o.base), a(o.base_texture), a(o.emission), a(o.emission_texture), a(o.unlit);
  a(o.metallic), a(o.roughness), a(o.reflectance), a(o.edge_reflectance);
  a(o.metallic_texture), a(o.roughness_texture), a(o.normal_texture), a(o.normal_scale);
}

template <class Archive>
void archive(Archive& a, GraphCamera& o) {
  a(o.name), a(o.node), a(o.horizontal_fov_rad), a(o.T_node_camera);
}

template <class Archive>
void archive(Archive& a, SceneGraph& o) {
  a(o.nodes), a(o.meshes), a(o.materials), a(o.images), a(o.cameras), a(o.ignores_alpha), a(o.relief), a(o.bump_maps),
      a(o.warnings), a(o.gloss_warnings), a(o.files), a(o.vertex_numbers);
}

/// Whether a type is stored as its bytes.
template <typename T>
inline constexpr bool kIsFlat = std::is_arithmetic_v<T> || std::is_enum_v<T>;
template <typename Scalar, int Rows, int Columns>
inline constexpr bool kIsFlat<Eigen::Matrix<Scalar, Rows, Columns>> = true;
template <typename T, std::size_t N>
inline constexpr bool kIsFlat<std::array<T, N>> = kIsFlat<T>;

class Writer {
 public:
  template <typename T>
  void operator()(T& value) {
    if constexpr (kIsFlat<T>) {
      put(&value, sizeof value);
    } else {
      archive(*this, value);
    }
  }
  void operator()(std::string& text) { put_all(text); }
  template <typename T>
  void operator()(std::optional<T>& value) {
    bool there = value.has_value();
    (*this)(there);
    if (there) (*this)(*value);
  }
  template <typename T>
  void operator()(std::vector<T>& values) {
    if constexpr (kIsFlat<T>) {
      put_all(values);
    } else {
      std::size_t count = values.size();
      (*this)(count);
      for (T& value : values) (*this)(value);
    }
  }

  std::string take() { return std::move(bytes_); }

 private:
  template <class Range>
  void put_all(Range& values) {
    std::size_t count = values.size();
    (*this)(count);
    if (count > 0) put(values.data(), count * sizeof values[0]);
  }
  void put(const void* data, std::size_t size) { bytes_.append(static_cast<const char*>(data), size); }

  std::string bytes_;
};

class Reader {
 public:
  explicit Reader(std::string_view bytes) : bytes_(bytes) {}

  template <typename T>
  void operator()(T& value) {
    if constexpr (kIsFlat<T>) {
      get(&value, sizeof value);
    } else {
      archive(*this, value);
    }
  }
  void operator()(std::string& text) { get_all(text); }
  template <typename T>
  void operator()(std::optional<T>& value) {
    bool there = false;
    (*this)(there);
    if (there) (*this)(value.emplace());
  }
  template <typename T>
  void operator()(std::vector<T>& values) {
    if constexpr (kIsFlat<T>) {
      get_all(values);
    } else {
      std::size_t count = 0;
      (*this)(count);
      require(count);
      values.resize(count);
      for (T& value : values) (*this)(value);
    }
  }

 private:
  template <class Range>
  void get_all(Range& values) {
    std::size_t count = 0;
    (*this)(count);
    require(count);
    require(count * sizeof values[0]);
    values.resize(count);
    if (count > 0) get(values.data(), count * sizeof values[0]);
  }
  void get(void* data, std::size_t size) {
    require(size);
    std::memcpy(data, bytes_.data(), size);
    bytes_.remove_prefix(size);
  }
  void require(std::size_t size) const {
    if (size > bytes_.size()) throw InternalError("the bytes of a scene graph are cut off");
  }

  std::string_view bytes_;
};

}  // namespace

std::string to_bytes(const SceneGraph& graph) {
  Writer writer;
  SceneGraph copy = graph;
  writer(copy);
  return writer.take();
}

SceneGraph graph_from_bytes(std::string_view bytes) {
  SceneGraph graph;
  Reader reader(bytes);
  reader(graph);
  return graph;
}

}  // namespace esim::inline scene
