#include "esim/backends/raycast/raster/sheets.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <functional>
#include <numeric>
#include <utility>

namespace esim::inline backends::inline raycast {
namespace {

constexpr float kFlat = 0.05F;     // in sides of a pixel: how far one surface may be from the plane of a triangle in it
constexpr float kOverlap = 1e-3F;  // of a sheet with itself, as an area
constexpr std::uint8_t kNoSheet = 0, kOutside = 255;
constexpr std::size_t kMaxFound = 64;  // more triangles in a pixel have more sheets than one

std::size_t hash_of(std::uint32_t index) { return index * 0x9e3779b1U; }

}  // namespace

void Sheets::make_table() {
  const std::size_t count = surfaces_->triangle_count(), size = std::bit_ceil(2 * count + 1);
  slots_.assign(size, kNone);
  for (std::uint32_t i = 0; i < count; ++i) {
    std::size_t slot = hash_of(surfaces_->triangle(i).index) & (size - 1);
    while (slots_[slot] != kNone) slot = (slot + 1) & (size - 1);
    slots_[slot] = i;
  }
  beyond_.assign(count, {}), place_.resize(count);
}

/// The triangle of the cell with this index in the scene; kNone if it has none.
std::uint32_t Sheets::find(std::uint32_t index) const {
  const std::size_t last = slots_.size() - 1;
  for (std::size_t slot = hash_of(index) & last; slots_[slot] != kNone; slot = (slot + 1) & last) {
    if (surfaces_->triangle(slots_[slot]).index == index) return slots_[slot];
  }
  return kNone;
}

Sheets::Beyond Sheets::look_beyond(const ScreenTriangle& here, std::size_t side) const {
  const NextTriangle next = triangles_.next(here.index, side);
  constexpr Beyond kNothing{kNone, true, false, false};
  if (!next.exists()) return kNothing;
  const std::uint32_t found = find(here.index + static_cast<std::uint32_t>(next.apart()));
  if (found == kNone) return kNothing;
  const ScreenTriangle& there = surfaces_->triangle(found);
  const std::size_t a = (side + 1) % 3, b = (side + 2) % 3;
  for (std::size_t back = 0; back < 3; ++back) {
    // Deforming triangles that had a common side may have moved apart.
    const std::size_t c = (back + 1) % 3, d = (back + 2) % 3;
    const bool is_common = (here.has_corner(a, there, c) && here.has_corner(b, there, d)) ||
                           (here.has_corner(a, there, d) && here.has_corner(b, there, c));
    if (!is_common) continue;
    const bool folds = here.x[side] * there.x[back] + here.y[side] * there.y[back] >= 0;
    return {found, true, folds, next.continues()};
  }
  return kNothing;
}

/// Whether the rectangle around a triangle meets that of the pixel.
bool Sheets::meets_pixel(const ScreenTriangle& triangle) const {
  if (!triangle.is_in_front()) return true;
  const auto meets = [](const std::array<float, 3>& corner, float at, float half) {
    return std::max({corner[0], corner[1], corner[2]}) >= at - half &&
           std::min({corner[0], corner[1], corner[2]}) <= at + half;
  };
  return meets(triangle.corner_x, x_, half_width_) && meets(triangle.corner_y, y_, half_height_);
}

/// Whether the rectangle around a side of a triangle, whose corners are in front of the camera, meets that of the
/// pixel.
bool Sheets::meets_pixel(const ScreenTriangle& triangle, std::size_t side) const {
  const std::size_t a = (side + 1) % 3, b = (side + 2) % 3;
  const auto apart = [](float from, float to, float at, float half) {
    return std::fabs(from + to - 2 * at) - std::fabs(to - from) - 2 * half;
  };
  return std::max(apart(triangle.corner_x[a], triangle.corner_x[b], x_, half_width_),
                  apart(triangle.corner_y[a], triangle.corner_y[b], y_, half_height_)) <= 0;
}

/// The nearest triangle without a sheet; kNone if all have one.
std::uint32_t Sheets::nearest_of_rest() const {
  std::uint32_t nearest = kNone;
  for (std::uint32_t i = 0; i < found_.size(); ++i) {
    if (sheet_[i] == kNoSheet && (nearest == kNone || found_[i].nearest > found_[nearest].nearest)) nearest = i;
  }
  return nearest;
}

/// Makes the sheet of a triangle: from each triangle, it continues beyond the sides that meet the pixel.
void Sheets::grow(std::uint32_t first, Sheet& sheet) {
  sheet.members.assign(1, first), sheet.folds.clear();
  sheet.farthest = kInfinity;
  sheet.ends = sheet.too_near = false, sheet.continues = true, sheet.middle = kNone;
  sheet.number = sheet_[first] = ++sheet_count_;
  for (std::size_t next = 0; next < sheet.members.size(); ++next) {
    const PixelTriangle& here = found_[sheet.members[next]];
    const ScreenTriangle& triangle = surfaces_->triangle(here.triangle);
    sheet.too_near = sheet.too_near || !triangle.is_in_front();
    sheet.farthest = std::min(sheet.farthest, here.farthest);
    if (here.in_middle) sheet.middle = here.triangle;
    for (unsigned left = here.crossing; left != 0; left &= left - 1) {
      const auto side = static_cast<std::uint8_t>(std::countr_zero(left));
      if (!meets_pixel(triangle, side)) continue;
      const Beyond& beyond = this->beyond(here.triangle, side);
      const std::uint32_t i = beyond.triangle != kNone ? place_[beyond.triangle] : kNone;
      if (i >= found_.size() || found_[i].triangle != beyond.triangle || sheet_[i] == kOutside) {
        sheet.ends = true;
      } else if (beyond.folds) {
        sheet.folds.push_back({here.triangle, side});
      } else {
        sheet.continues = sheet.continues && beyond.continues;
        if (sheet_[i] == kNoSheet) sheet_[i] = sheet.number, sheet.members.push_back(i);
      }
    }
  }
}

/// Whether a sheet is the back of a body whose front is another one: they meet at all ends of both, and there the front
/// is nearer.
bool Sheets::is_back(const Sheet& sheet, const Sheet& front) {
  if (sheet.ends || front.ends || sheet.folds.empty() || sheet.folds.size() != front.folds.size()) return false;
  return std::ranges::all_of(sheet.folds, [&](const Fold& fold) {
    const std::uint32_t other = beyond(fold.triangle, fold.side).triangle;
    if (sheet_[place_[other]] != front.number) return false;
    const ScreenTriangle &back = surfaces_->triangle(fold.triangle), &near = surfaces_->triangle(other);
    // Of the inverse depth, inwards from the fold.
    return (near.x[3] - back.x[3]) * back.x[fold.side] + (near.y[3] - back.y[3]) * back.y[fold.side] > 0;
  });
}

/// Whether a triangle is behind a sheet, wherever that is in the pixel.
bool Sheets::is_behind(const PixelTriangle& triangle, const Sheet& sheet) const {
  if (triangle.nearest < sheet.farthest) return true;
  return std::ranges::all_of(sheet.members, [&](std::uint32_t member) {
    const PixelTriangle& other = found_[member];
    const float s = triangle.s[3] - other.s[3], t = triangle.t[3] - other.t[3];
    return triangle.middle[3] + 0.5F * (std::fabs(s) + std::fabs(t)) < other.middle[3];
  });
}

/// The same for a sheet.
bool Sheets::is_behind(const Sheet& sheet, const Sheet& front) const {
  return std::ranges::all_of(sheet.members, [&](std::uint32_t member) { return is_behind(found_[member], front); });
}

/// Whether all triangles without a sheet are behind one.
bool Sheets::is_rest_behind(const Sheet& sheet) const {
  for (std::uint32_t i = 0; i < found_.size(); ++i) {
    if (sheet_[i] == kNoSheet && !is_behind(found_[i], sheet)) return false;
  }
  return true;
}

bool Sheets::divide(std::uint16_t pixel, std::span<const PixelTriangle> found, std::vector<Fragment>& fragments) {
  if (slots_.empty()) make_table();
  pixel_ = pixel, found_ = found, sheet_count_ = 0;
  x_ = cell_->x[pixel], y_ = cell_->y[pixel];
  constexpr float kRounding = 2e-6F;  // of bearings
  const float rounding = kRounding * cell_->extent;
  half_width_ = 0.5F * (std::fabs(cell_->dx_du[pixel]) + std::fabs(cell_->dx_dv[pixel])) + rounding;
  half_height_ = 0.5F * (std::fabs(cell_->dy_du[pixel]) + std::fabs(cell_->dy_dv[pixel])) + rounding;
  if (found.size() > kMaxFound) return false;
  sheet_.clear();
  for (std::uint32_t i = 0; i < found.size(); ++i) {
    place_[found[i].triangle] = i;
    const bool is_met = !found[i].outside && meets_pixel(surfaces_->triangle(found[i].triangle));
    sheet_.push_back(is_met ? kNoSheet : kOutside);
  }

  std::uint32_t nearest = nearest_of_rest();
  if (nearest == kNone) return true;
  grow(nearest, front_);
  has_back_ = has_behind_ = false;
  while (true) {
    if (front_.too_near) return false;
    const Sheet& last = has_behind_ ? behind_ : front_;
    if (last.covers() && is_rest_behind(last)) break;
    nearest = nearest_of_rest();
    if (nearest == kNone && !front_.covers()) break;
    if (nearest == kNone || front_.covers()) return false;
    grow(nearest, other_);
    if (other_.too_near) return false;
    if (!has_back_ && is_back(other_, front_)) {
      std::swap(back_, other_);
      has_back_ = true;
    } else if (!has_back_ && !has_behind_ && is_back(front_, other_)) {
      std::swap(back_, front_);
      std::swap(front_, other_);
      has_back_ = true;
    } else if (!has_behind_ && other_.covers() && is_behind(other_, front_)) {
      std::swap(behind_, other_);
      has_behind_ = true;
    } else {
      return false;
    }
  }
  return front_.covers() ? cover(fragments) : overlay(fragments);
}

/// The fragments of a pixel that the sheet in front covers.
bool Sheets::cover(std::vector<Fragment>& fragments) {
  if (is_one_surface(front_)) {
    fragments.emplace_back(front_.middle, pixel_);
    return true;
  }
  const std::size_t before = fragments.size();
  if (!append(front_, fragments)) return false;
  join(fragments, before);
  return true;
}

/// The fragments of a pixel whose part that the sheet in front leaves shows the sheet behind, or nothing.
bool Sheets::overlay(std::vector<Fragment>& fragments) {
  if (has_behind_ && !is_one_surface(behind_)) return false;
  const std::size_t before = fragments.size();
  const auto area_from = [&](std::size_t first) {
    return std::transform_reduce(fragments.begin() + static_cast<std::ptrdiff_t>(first), fragments.end(), 0.0F,
                                 std::plus<>(), [](const Fragment& fragment) { return fragment.area; });
  };
  const auto give_up = [&] {
    fragments.resize(before);
    return false;
  };
  if (!append(front_, fragments)) return false;
  const float area = area_from(before);
  if (area > 1 + kOverlap) return give_up();
  if (has_back_) {
    // Around a folded corner, the back may be larger.
    const std::size_t end = fragments.size();
    if (!append(back_, fragments) || area_from(end) > area + kOverlap) return give_up();
    fragments.resize(end);
  }
  Moments left = Moments::pixel();
  for (const Fragment& fragment : std::span(fragments).subspan(before)) left -= fragment.moments();
  join(fragments, before);
  if (has_behind_ && left.area > kSmallestArea) fragments.emplace_back(behind_.middle, pixel_, left);
  return true;
}

/// Whether a sheet that covers the pixel is one surface.
bool Sheets::is_one_surface(const Sheet& sheet) const {
  if (!sheet.continues) return false;
  const ScreenTriangle& middle = surfaces_->triangle(sheet.middle);
  const auto inside = [](const std::array<float, 3>& corner, float at, float half) {
    return std::clamp((corner[0] + corner[1] + corner[2]) / 3, at - half, at + half);
  };
  return std::ranges::all_of(sheet.members, [&](std::uint32_t member) {
    const ScreenTriangle& other = surfaces_->triangle(found_[member].triangle);
    return is_flat(middle, other, inside(other.corner_x, x_, half_width_), inside(other.corner_y, y_, half_height_));
  });
}

/// Whether the planes of two triangles are near to each other at a bearing.
bool Sheets::is_flat(const ScreenTriangle& one, const ScreenTriangle& other, float x, float y) const {
  const float z = one.inverse_depth().at(x, y), difference = std::fabs(z - other.inverse_depth().at(x, y));
  return difference <= kFlat * (half_width_ + half_height_) * z;
}

/// Appends a fragment for each triangle of a sheet. False if one cannot be clipped.
bool Sheets::append(const Sheet& sheet, std::vector<Fragment>& fragments) {
  const PixelFrame frame(*cell_, pixel_);
  const std::size_t before = fragments.size(), count = sheet.members.size();
  for (std::size_t first = 0; first < count; first += ClippedTriangles::kCount) {
    const std::size_t used = std::min(ClippedTriangles::kCount, count - first);
    const auto triangle = [&](std::size_t lane) { return found_[sheet.members[first + lane]].triangle; };
    for (std::size_t lane = 0; lane < used; ++lane) {
      if (clipped_.set(lane, surfaces_->triangle(triangle(lane)), frame)) continue;
      fragments.resize(before);
      return false;
    }
    clipped_.integrate();
    for (std::size_t lane = 0; lane < used; ++lane) {
      const Moments part = clipped_.moments(lane);
      if (part.area > kSmallestArea) fragments.emplace_back(triangle(lane), pixel_, part);
    }
  }
  return true;
}

void Sheets::join(std::vector<Fragment>& fragments, std::size_t first) {
  for (; first + 1 < fragments.size(); ++first) {
    // The largest fragment takes those that continue it, and decides where the surface is shaded.
    const auto begin = fragments.begin() + static_cast<std::ptrdiff_t>(first);
    std::iter_swap(begin, std::ranges::max_element(begin, fragments.end(), {}, &Fragment::area));
    const ScreenTriangle& largest = surfaces_->triangle(begin->triangle);
    if (!largest.is_in_front()) continue;
    Moments sum = begin->moments();
    joined_.assign(1, begin->triangle);
    for (std::size_t next = 0; next < joined_.size(); ++next) {
      for (std::size_t side = 0; side < 3; ++side) {
        const Beyond beyond = this->beyond(joined_[next], side);
        if (beyond.folds || !beyond.continues) continue;
        const auto found = std::ranges::find(begin + 1, fragments.end(), beyond.triangle, &Fragment::triangle);
        if (found == fragments.end()) continue;
        const auto [s, t] = found->centroid;
        const float x = x_ + cell_->dx_du[pixel_] * s + cell_->dx_dv[pixel_] * t;
        const float y = y_ + cell_->dy_du[pixel_] * s + cell_->dy_dv[pixel_] * t;
        if (!is_flat(largest, surfaces_->triangle(beyond.triangle), x, y)) continue;
        sum += found->moments();
        joined_.push_back(beyond.triangle);
        *found = fragments.back();
        fragments.pop_back();
      }
    }
    if (joined_.size() > 1) *begin = Fragment(begin->triangle, pixel_, sum);
  }
}

}  // namespace esim::inline backends::inline raycast
