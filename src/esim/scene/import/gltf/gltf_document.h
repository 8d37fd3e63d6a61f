#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <vector>

// Private to scene: includes nlohmann/json.hpp.
namespace esim::inline scene {

/// A glTF 2.0 file as text and bytes. The content is not trusted: a value that is missing, of the wrong type or out of
/// range throws UserError with the file's name.
class GltfDocument {
 public:
  using Json = nlohmann::json;

  explicit GltfDocument(const std::filesystem::path& file);

  /// A list at the top level of the document; empty if it is missing.
  const Json& list(const char* name) const;

  /// The default scene of the file, which has at least one.
  std::size_t first_scene() const;

  /// A member of an object, or null.
  static const Json* find(const Json& object, const char* name);

  /// A member that is an index into a list at the top level.
  std::size_t index(const Json& object, const char* name, const char* into) const;
  bool has_index(const Json& object, const char* name) const { return find(object, name) != nullptr; }

  double number(const Json& object, const char* name, double otherwise) const;
  bool flag(const Json& object, const char* name) const;

  /// A member that is text, without control characters.
  std::string text(const Json& object, const char* name, const std::string& otherwise = {}) const;

  /// A member that is a list of numbers, as many as `otherwise` has; `otherwise` if it is missing.
  std::vector<double> numbers(const Json& object, const char* name, std::vector<double> otherwise) const;

  /// The elements of an accessor of floating-point (or normalised integer) vectors, concatenated, all finite.
  std::vector<float> floats(std::size_t accessor, std::size_t components) const;

  /// As floats(), but the numbers need not be finite, and integers need not be normalised.
  std::vector<float> unchecked_floats(std::size_t accessor, std::size_t components) const;

  /// The number of elements that an accessor states; it is not checked.
  std::size_t element_count(std::size_t accessor) const { return whole(list("accessors")[accessor], "count", 0); }

  /// The bytes of all buffers.
  std::size_t bytes() const;

  /// The elements of an accessor of unsigned integers, concatenated.
  std::vector<std::uint32_t> integers(std::size_t accessor, std::size_t components = 1) const;

  std::span<const std::byte> buffer_view(std::size_t index) const;

  /// The bytes of a data: URI.
  std::vector<std::byte> data_uri(const std::string& uri) const;

  [[noreturn]] void fail(const std::string& reason) const;

 private:
  struct Accessor {
    std::span<const std::byte> bytes;  // starting at the first element; empty: all elements are zero
    std::size_t count = 0, stride = 0;
    int component_type = 0;
    bool normalised = false;
  };

  std::size_t whole(const Json& object, const char* name, std::size_t otherwise) const;
  /// Elements of `element_bytes` each that begin at `byteOffset` of the bufferView that `json` names.
  Accessor located(const Json& json, std::size_t count, std::size_t element_bytes, const std::string& what) const;
  Accessor accessor(std::size_t index, std::size_t components) const;
  template <typename T>
  std::vector<T> elements(std::size_t accessor, std::size_t components, T (*convert)(const std::byte*, int)) const;
  void parse(std::span<const std::byte> text);
  void load_buffers(std::vector<std::byte> binary);

  std::filesystem::path file_;
  Json root_;
  std::vector<std::vector<std::byte>> buffers_;
};

}  // namespace esim::inline scene
