#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

namespace esim {

/// How often magnitudes of displacement lie where: `shares[i]` of them between `edges[i]` and `edges[i + 1]`, px.
struct MagnitudeHistogram {
  std::vector<double> edges{};   ///< increasing, from 0 on; one more than shares
  std::vector<double> shares{};  ///< not negative, sum 1
  std::string source{};          ///< where it is from, for reports

  std::size_t bins() const { return shares.size(); }

  /// The bin of a magnitude >= 0; bins() beyond the last edge.
  std::size_t bin_of(double magnitude) const;

  /// The magnitude that a share u of all is below: uniform within each bin. 0 <= u < 1.
  double quantile(double u) const;

  /// The same with all magnitudes `factor` times as large.
  MagnitudeHistogram scaled(double factor) const;
};

/// The optical flow of MPI Sintel (Butler, Wulff, Stanley, Black, "A naturalistic open source movie for optical flow
/// evaluation", ECCV 2012), px per frame of 1/24 s at 1024 x 436.
///
/// Its benchmark publishes end-point errors of all pixels, and of those below 10, from 10 to 40 and from 40 px per
/// frame on. The first is the mean of the others, weighted by their shares of the pixels; these follow from the results
/// of any three methods. Those of ten methods (docs/methods/dataset.md lists them) agree to 0.002 px on 59.3 %, 28.8 %
/// and 11.9 %. The histogram is that of a log-normal distribution, cut off at 160 px, with these shares.
MagnitudeHistogram sintel_magnitudes();

/// Reads lines "LOW HIGH WEIGHT", px and any unit, in order and without gaps from 0 on; # begins a comment. Throws
/// UserError naming file and line.
MagnitudeHistogram read_magnitudes(const std::filesystem::path& file);

/// Half the sum of the differences of two histograms' shares: the share of pixels that would have to be moved to
/// another bin; from 0 to 1.
double total_variation(const std::vector<double>& a, const std::vector<double>& b);

}  // namespace esim
