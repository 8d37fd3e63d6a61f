#pragma once

#include <hwy/highway.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <utility>
#include <vector>

#include "esim/core/image.h"
#include "esim/core/large_vector.h"
#include "esim/scene/images/box_filter.h"

namespace cv {
class Mat;
}

namespace esim::inline scene {

/// How a texture continues beyond its edges.
enum class Wrap { repeat, clamp };

/// Texture coordinates of K pixels, and their footprints. u points to the right, v downwards; the image spans
/// [0, 1] x [0, 1]. One array per quantity, for SIMD code; K is 4 or a multiple of 8.
template <int K>
struct TextureLookup {
  alignas(64) std::array<float, K> u, v;
  alignas(64) std::array<float, K> du_dx, dv_dx;  // change of (u, v) over one pixel to the right
  alignas(64) std::array<float, K> du_dy, dv_dy;  // change of (u, v) over one pixel downwards
};

/// A linear-light image that can be averaged over a pixel's footprint, a parallelogram. Between its texels, the image
/// is interpolated bilinearly; docs/methods/rendering.md has the filter and its accuracy.
///
/// A pyramid holds the image at resolutions that decrease by sqrt(2). On one of its levels, the filter has 4 x 4 taps,
/// with the widths of the footprint along u and v; a long or slanted footprint takes several such probes along its
/// longer side. All weights are >= 0, so that nothing rings around bright light.
///
/// Rendering waits for memory more than it computes. So the levels are stored in overlapping blocks of one page of
/// memory: the 4 x 4 taps of a probe lie in one block. And a texel has 16 bits: an unsigned floating-point number with
/// 11 bits of mantissa, relative to the brightest texel. The relative error is at most 2^-12, far below that of 8-bit
/// images, down to 2^-31 of the brightest texel; darker texels are raised to that. Values that are negative or not a
/// number become 0.
class Texture {
 public:
  Texture(const Image<float>& texels, Wrap wrap_u, Wrap wrap_v);

  /// Mean of the texture over each of the K footprints. Lanes whose bit in `lanes` is not set are undefined.
  template <int K>
  std::array<float, K> sample(const TextureLookup<K>& at, std::uint32_t lanes = ~0U) const;

  int width() const { return static_cast<int>(level_width_[0]); }
  int height() const { return static_cast<int>(level_height_[0]); }

  Wrap wrap_u() const { return wrap_u_; }
  Wrap wrap_v() const { return wrap_v_; }

  /// The stored texels at full resolution.
  Image<float> texels() const;

 private:
  static constexpr int kMaxLevels = 36;
  static constexpr int kMaxProbes = 8;

  // Texels that continue a level beyond its edges: as far as any tap reaches.
  static constexpr int kBefore = 3, kAfter = 4;

  // A block, row by row: 4 KiB. Its last columns and rows are the first ones of its neighbours.
  static constexpr int kBlockWidth = 32, kBlockHeight = 64, kOverlap = 3;
  static constexpr int kBlockRowBytes = 2 * kBlockWidth, kBlockBytes = kBlockRowBytes * kBlockHeight;

  // A code is the upper 16 bits of value / scale_ as a float, without those that are the same in all: see encode().
  static constexpr int kCodeShift = 12;
  static constexpr std::uint32_t kCodeBias = 96U << 23;

  // Footprints are measured by squares of widths, in texels: 12 times the variance, that is w^2 for a box of width w.
  // A footprint of the square width kWidestBox2 or more is filtered on a coarser level.
  static constexpr float kBlend = 0.1F;     // the part of the range of a level in which it is blended with the next
  static constexpr float kFirstLevel2 = 9;  // below the square widths of that part, on the first level
  static constexpr float kReduction2 = 2;   // of the second level

  /// The mip levels that the lanes of a vector sample.
  template <class V, class I>
  struct Grid {
    V width, height;               // texels
    V squared_u, squared_v, blur;  // squares of its width and height over those of level 0; see level_blur_
    I offset, stride;              // bytes: of the level, and from a block to the one below
  };

  /// The second moments of footprints, times 12, in square texels of level 0.
  template <class V>
  struct Moments {
    V uu, uv, vv;
  };

  /// The footprints of pixels on the texture.
  template <class V>
  struct Footprint {
    V width2_u, width2_v;  // square widths of a probe, in texels of level 0
    V step_u, step_v;      // from one probe to the next
    V probes, per_probe;   // 1 / probes
    V lod;                 // level of the pyramid
  };

  template <class V>
  struct TwoOf {
    V first, second;
  };

  static int blocks(int texels, int block);
  static std::size_t codes(int width, int height);
  void append(const cv::Mat& level);
  cv::Mat reduced(const cv::Mat& image) const;
  std::uint16_t encode(float value) const;
  template <class D, class Lookup>
  auto moments(D d, const Lookup& at, std::size_t i) const;
  template <class D, class V>
  Footprint<V> footprint(D d, const Moments<V>& moments) const;
  template <class D, class I>
  auto grid(D d, I level) const;
  template <class D, class V>
  static V binary_logarithm(D d, V x);
  template <class D, class V>
  static auto to_integer(D d, V x);
  template <class D, class V>
  V interpolated(D d, V u, V v) const;
  template <class D, class V, class I>
  V mean(D d, const Footprint<V>& footprint, V u, V v, const Grid<V, I>& on) const;
  template <class D, class W>
  static auto decoded(D d, W words);
  template <class D, class I>
  auto two_texels(D d, I position) const;
  template <class D>
  static auto words(D d, const char* from, const std::int32_t* bytes);
  template <class D>
  static auto four_texels(D d, const char* from, const std::int32_t* bytes);
  template <class D, class V>
  static void locate(D d, V coordinate, V size, Wrap wrap, V& first, V& t);
  template <class D, class V, class I>
  static I position(D d, V column, V row, const Grid<V, I>& on);

  Wrap wrap_u_, wrap_v_;
  int levels_ = 0;
  float scale_ = 1;
  std::array<float, kMaxLevels> level_width_{}, level_height_{}, level_squared_u_{}, level_squared_v_{};
  std::array<float, kMaxLevels> level_blur_{};  // what the square width of the taps leaves to the level's texels
  std::array<std::int32_t, kMaxLevels> level_offset_{}, level_stride_{};  // bytes
  LargeVector<std::uint16_t> codes_;  // all levels with their continuations, each in rows of blocks
};

}  // namespace esim::inline scene

#include "esim/scene/images/texture_sampling.h"
