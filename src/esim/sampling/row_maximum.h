#pragma once

#include <algorithm>
#include <vector>

#include "esim/core/parallel.h"

namespace esim::inline sampling {

/// Maximum of row_value(y) over all rows, computed in parallel; independent of the number of threads.
template <typename RowValue>
float row_maximum(int rows, const Workers& workers, const RowValue& row_value) {
  constexpr int kRowsPerPiece = 32;
  const int pieces = (rows + kRowsPerPiece - 1) / kRowsPerPiece;
  std::vector<float> maxima(static_cast<std::size_t>(pieces), 0.0F);
  workers.for_each(pieces, [&](int piece) {
    float& maximum = maxima[static_cast<std::size_t>(piece)];
    for (int y = piece * kRowsPerPiece; y < std::min(rows, (piece + 1) * kRowsPerPiece); ++y) {
      maximum = std::max(maximum, row_value(y));
    }
  });
  return pieces > 0 ? *std::max_element(maxima.begin(), maxima.end()) : 0.0F;
}

}  // namespace esim::inline sampling
