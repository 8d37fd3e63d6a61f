#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

#include "esim/core/error.h"
#include "esim/core/image.h"

namespace esim::inline core {

/// Serialises the state of an object for a StateReader of the same build of esim. An object lists its members once, in
/// a static template `transfer(archive, self)`, for the writer and the reader.
class StateWriter {
 public:
  explicit StateWriter(std::vector<std::byte>& out) : out_(out) {}

  template <class T>
  void value(const T& value) {
    static_assert(std::is_trivially_copyable_v<T>);
    append(&value, sizeof(T));
  }

  /// A vector or span whose length differs from object to object.
  template <class List>
  void list(const List& values) {
    value(static_cast<std::uint64_t>(values.size()));
    fixed(values);
  }

  /// A vector or span whose length is determined by the constructor's arguments.
  template <class List>
  void fixed(const List& values) {
    static_assert(std::is_trivially_copyable_v<typename List::value_type>);
    append(values.data(), values.size() * sizeof(typename List::value_type));
  }

  void text(const std::string& text) { list(std::span(text)); }

  /// An image whose size is determined by the constructor's arguments.
  void image(const Image<float>& image) { append(image.data(), image.size() * sizeof(float)); }

  /// An image whose size differs.
  template <class T>
  void sized_image(const Image<T>& image) {
    static_assert(std::is_trivially_copyable_v<T>);
    value(image.width());
    value(image.height());
    append(image.data(), image.size() * sizeof(T));
  }

  /// An object with members save(archive) and restore(archive).
  template <class T>
  void object(const T& object) {
    object.save(*this);
  }

  /// A list of objects, by transfer_one(archive, object).
  template <class List, class TransferOne>
  void objects(const List& objects, const TransferOne& transfer_one) {
    value(static_cast<std::uint64_t>(objects.size()));
    for (const auto& object : objects) transfer_one(*this, object);
  }

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
  void text(std::string& text) {
    std::vector<char> characters;
    list(characters);
    text.assign(characters.begin(), characters.end());
  }
  void image(Image<float>& image) { take(image.data(), image.size()); }
  template <class T>
  void sized_image(Image<T>& image) {
    static_assert(std::is_trivially_copyable_v<T>);
    int width = 0, height = 0;
    value(width);
    value(height);
    if (width < 0 || height < 0 ||
        (height > 0 && static_cast<std::size_t>(width) > in_.size() / sizeof(T) / static_cast<std::size_t>(height)))
      fail();
    if (image.width() != width || image.height() != height) image = Image<T>(width, height);
    take(image.data(), image.size());
  }
  template <class T>
  void object(T& object) {
    object.restore(*this);
  }
  template <class List, class TransferOne>
  void objects(List& objects, const TransferOne& transfer_one) {
    std::uint64_t count = 0;
    value(count);
    if (count > in_.size()) fail();
    if constexpr (std::is_default_constructible_v<typename List::value_type>) {
      objects.resize(static_cast<std::size_t>(count));
    } else if (objects.size() != count) {
      fail();
    }
    for (auto& object : objects) transfer_one(*this, object);
  }

  bool at_end() const { return in_.empty(); }

  [[noreturn]] static void fail() {
    throw UserError(
        "the saved state is damaged, or belongs to an object with other arguments; restore it into one that was "
        "created "
        "with the same arguments, by the same build of esim");
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

}  // namespace esim::inline core
