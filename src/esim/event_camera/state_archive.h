#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <type_traits>
#include <vector>

#include "esim/core/error.h"
#include "esim/core/image.h"

// Private to event_camera.
namespace esim::inline event_camera {

/// Serialises the state of an object. An object lists its members once, in a template `transfer(archive, self)`, for
/// the writer and the reader.
class StateWriter {
 public:
  explicit StateWriter(std::vector<std::byte>& out) : out_(out) {}

  template <class T>
  void value(const T& value) {
    static_assert(std::is_trivially_copyable_v<T>);
    append(&value, sizeof(T));
  }

  /// A list whose length differs from object to object.
  template <class T, class Allocator>
  void list(const std::vector<T, Allocator>& values) {
    value(static_cast<std::uint64_t>(values.size()));
    fixed(values);
  }

  /// A list whose length is determined by the constructor's arguments.
  template <class T, class Allocator>
  void fixed(const std::vector<T, Allocator>& values) {
    static_assert(std::is_trivially_copyable_v<T>);
    append(values.data(), values.size() * sizeof(T));
  }

  /// An image whose size is determined by the constructor's arguments.
  void image(const Image<float>& image) { append(image.data(), image.size() * sizeof(float)); }

 private:
  void append(const void* from, std::size_t bytes) {
    if (bytes == 0) return;
    const std::size_t offset = out_.size();
    out_.resize(offset + bytes);
    std::memcpy(out_.data() + offset, from, bytes);
  }

  std::vector<std::byte>& out_;
};

/// The counterpart of StateWriter. Throws UserError if the bytes end too early.
class StateReader {
 public:
  explicit StateReader(std::span<const std::byte> in) : in_(in) {}

  template <class T>
  void value(T& value) {
    static_assert(std::is_trivially_copyable_v<T>);
    take(&value, 1);
  }
  template <class T, class Allocator>
  void list(std::vector<T, Allocator>& values) {
    std::uint64_t count = 0;
    value(count);
    if (count > in_.size() / sizeof(T)) fail();
    values.resize(static_cast<std::size_t>(count));
    fixed(values);
  }
  template <class T, class Allocator>
  void fixed(std::vector<T, Allocator>& values) {
    static_assert(std::is_trivially_copyable_v<T>);
    take(values.data(), values.size());
  }
  void image(Image<float>& image) { take(image.data(), image.size()); }

  bool at_end() const { return in_.empty(); }

  [[noreturn]] static void fail() {
    throw UserError(
        "the state of an event camera is damaged, or belongs to another camera; restore it into a camera that was "
        "created with the same arguments");
  }

 private:
  template <class T>
  void take(T* to, std::size_t count) {
    const std::size_t bytes = count * sizeof(T);
    if (bytes > in_.size()) fail();
    if (bytes > 0) std::memcpy(static_cast<void*>(to), in_.data(), bytes);
    in_ = in_.subspan(bytes);
  }

  std::span<const std::byte> in_;
};

}  // namespace esim::inline event_camera
