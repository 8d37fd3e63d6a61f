#pragma once

#include <cassert>
#include <cstddef>
#include <span>
#include <vector>

namespace esim::inline core {

/// A rectangle of pixels: columns [x, x+width), rows [y, y+height).
struct Tile {
  int x = 0, y = 0, width = 0, height = 0;

  std::size_t area() const { return static_cast<std::size_t>(width) * static_cast<std::size_t>(height); }
  bool operator==(const Tile&) const = default;
};

/// Dense row-major image, rows contiguous, no padding. Element (x, y) is column x of row y.
template <typename T>
class Image {
 public:
  Image() = default;
  Image(int width, int height, T value = T{})
      : width_(width),
        height_(height),
        data_(static_cast<std::size_t>(width) * static_cast<std::size_t>(height), value) {
    assert(width >= 0 && height >= 0);
  }

  int width() const { return width_; }
  int height() const { return height_; }
  std::size_t size() const { return data_.size(); }
  bool empty() const { return data_.empty(); }
  Tile bounds() const { return {0, 0, width_, height_}; }

  T& operator()(int x, int y) { return data_[index(x, y)]; }
  const T& operator()(int x, int y) const { return data_[index(x, y)]; }

  T* row(int y) { return data_.data() + index(0, y); }
  const T* row(int y) const { return data_.data() + index(0, y); }

  std::span<T> pixels() { return data_; }
  std::span<const T> pixels() const { return data_; }
  T* data() { return data_.data(); }
  const T* data() const { return data_.data(); }

  void fill(T value) { data_.assign(data_.size(), value); }

 private:
  std::size_t index(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x);
  }

  int width_ = 0;
  int height_ = 0;
  std::vector<T> data_;
};

/// A view of an image, or of a tile that is stored separately. Coordinates are those of the image.
template <typename T>
class ImageView {
 public:
  ImageView() = default;
  ImageView(const Image<T>* image) : ImageView(image->data(), image->bounds()) {}
  /// `pixels`: the tile's, rows contiguous, no padding.
  ImageView(const T* pixels, const Tile& tile)
      : pixels_(pixels), stride_(tile.width), first_(tile.y * static_cast<std::ptrdiff_t>(tile.width) + tile.x) {}

  /// Only elements inside the tile may be read.
  const T* row(int y) const { return pixels_ + (y * stride_ - first_); }
  const T& operator()(int x, int y) const { return row(y)[x]; }

 private:
  const T* pixels_ = nullptr;
  std::ptrdiff_t stride_ = 0, first_ = 0;
};

}  // namespace esim::inline core
