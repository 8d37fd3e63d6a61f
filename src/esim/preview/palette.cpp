#include "esim/preview/palette.h"

#include <algorithm>
#include <vector>

namespace esim::inline preview {
namespace {

constexpr std::size_t kCells = 32 * 32 * 32;  // of colour space

std::size_t cell_of(Rgb colour) {
  return (static_cast<std::size_t>(colour.r) >> 3 << 10) | (static_cast<std::size_t>(colour.g) >> 3 << 5) |
         static_cast<std::size_t>(colour.b) >> 3;
}

// The pixels of a cell: their number, and the sums of their components.
struct Cell {
  std::size_t index = 0;
  std::uint64_t count = 0;
  std::array<std::uint64_t, 3> sum{};

  int level(std::size_t component) const { return static_cast<int>(index >> (10 - 5 * component) & 31); }
};

// Consecutive cells that share a colour.
struct Box {
  std::size_t first = 0, end = 0;
  std::uint64_t count = 0;
  std::size_t longest = 0;  // component
  int extent = 0;           // levels along it

  double urgency() const { return extent > 0 ? static_cast<double>(count) * extent * extent : 0; }
};

Box box_of(const std::vector<Cell>& cells, std::size_t first, std::size_t end) {
  Box box{first, end};
  std::array<int, 3> min{31, 31, 31}, max{};
  for (std::size_t i = first; i < end; ++i) {
    box.count += cells[i].count;
    for (std::size_t component = 0; component < 3; ++component) {
      min[component] = std::min(min[component], cells[i].level(component));
      max[component] = std::max(max[component], cells[i].level(component));
    }
  }
  for (std::size_t component = 0; component < 3; ++component) {
    if (max[component] - min[component] <= box.extent) continue;
    box.extent = max[component] - min[component];
    box.longest = component;
  }
  return box;
}

}  // namespace

PaletteImage reduce_colours(const Image<Rgb>& image) {
  std::vector<Cell> all(kCells);
  for (const Rgb pixel : image.pixels()) {
    Cell& cell = all[cell_of(pixel)];
    ++cell.count;
    cell.sum[0] += pixel.r;
    cell.sum[1] += pixel.g;
    cell.sum[2] += pixel.b;
  }
  std::vector<Cell> cells;
  for (std::size_t i = 0; i < kCells; ++i) {
    all[i].index = i;
    if (all[i].count > 0) cells.push_back(all[i]);
  }

  PaletteImage out{Image<std::uint8_t>(image.width(), image.height())};
  if (cells.empty()) return out;
  std::vector<Box> boxes = {box_of(cells, 0, cells.size())};
  while (boxes.size() < out.colours.size()) {
    const auto next = std::max_element(boxes.begin(), boxes.end(),
                                       [](const Box& a, const Box& b) { return a.urgency() < b.urgency(); });
    if (next->extent == 0) break;
    const Box box = *next;
    std::sort(cells.begin() + static_cast<std::ptrdiff_t>(box.first),
              cells.begin() + static_cast<std::ptrdiff_t>(box.end), [&box](const Cell& a, const Cell& b) {
                return std::pair(a.level(box.longest), a.index) < std::pair(b.level(box.longest), b.index);
              });
    std::size_t cut = box.first + 1;
    for (std::uint64_t before = cells[box.first].count; cut + 1 < box.end && 2 * before < box.count; ++cut)
      before += cells[cut].count;
    *next = box_of(cells, box.first, cut);
    boxes.push_back(box_of(cells, cut, box.end));
  }

  std::vector<std::uint8_t> colour_of(kCells);
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    std::array<std::uint64_t, 3> sum{};
    for (std::size_t cell = boxes[i].first; cell < boxes[i].end; ++cell) {
      colour_of[cells[cell].index] = static_cast<std::uint8_t>(i);
      for (std::size_t component = 0; component < 3; ++component) sum[component] += cells[cell].sum[component];
    }
    const auto mean = [&](std::size_t component) {
      return static_cast<std::uint8_t>((sum[component] + boxes[i].count / 2) / boxes[i].count);
    };
    out.colours[i] = {mean(0), mean(1), mean(2)};
  }
  std::transform(image.pixels().begin(), image.pixels().end(), out.indices.pixels().begin(),
                 [&](Rgb pixel) { return colour_of[cell_of(pixel)]; });
  return out;
}

}  // namespace esim::inline preview
