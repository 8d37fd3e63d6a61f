#include "esim/render/irradiance_check.h"

#include <cmath>
#include <string>

#include "esim/core/error.h"
#include "esim/core/vector_math.h"

namespace esim::inline render {
namespace {

using CheckTag = hn::CappedTag<float, 8>;

bool is_irradiance(float value) { return std::isfinite(value) && value >= 0; }

}  // namespace

bool all_irradiance(const Segment& segment, Rows rows) {
  const CheckTag d;
  const int lanes = static_cast<int>(hn::Lanes(d)), width = segment.tile.width;
  IrradianceCheck check(d);
  bool good = true;
  for (int y = rows.first; y < rows.last; ++y) {
    const float* const row = segment.irradiance1.row(y) + segment.tile.x;
    int x = 0;
    for (; x + lanes <= width; x += lanes) check.see(d, hn::LoadU(d, row + x));
    for (; x < width; ++x) good &= is_irradiance(row[x]);
  }
  return good && check.passed();
}

void check_irradiance(const Segment& segment) {
  const Tile& tile = segment.tile;
  if (all_irradiance(segment, {tile.y, tile.y + tile.height})) return;
  for (int y = tile.y; y < tile.y + tile.height; ++y) {
    const float* const row = segment.irradiance1.row(y);
    for (int x = tile.x; x < tile.x + tile.width; ++x) {
      if (is_irradiance(row[x])) continue;
      throw UserError("irradiance " + std::to_string(row[x]) + " of pixel (" + std::to_string(x) + ", " +
                      std::to_string(y) + ") at t = " + std::to_string(to_seconds(segment.t1)) +
                      " s must be a finite number >= 0; check the source of the images");
    }
  }
}

}  // namespace esim::inline render
