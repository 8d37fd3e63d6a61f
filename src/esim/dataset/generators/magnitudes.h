#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

namespace esim::inline dataset {

/// A histogram of magnitudes of optical flow: the fraction `fractions[i]` lies between `edges[i]` and `edges[i + 1]`,
/// px.
struct MagnitudeHistogram {
  std::vector<double> edges{};      ///< increasing, from 0 on; one more than fractions
  std::vector<double> fractions{};  ///< not negative, sum 1
  std::string source{};             ///< name of its origin, for reports

  std::size_t bins() const { return fractions.size(); }

  /// The bin of a magnitude >= 0; bins() beyond the last edge.
  std::size_t bin_of(double magnitude) const;

  /// The magnitude below which a fraction u lies, with uniform density within each bin. 0 <= u < 1.
  double quantile(double u) const;

  /// The histogram of `factor` times the magnitudes.
  MagnitudeHistogram scaled(double factor) const;
};

/// The optical flow of MPI Sintel (Butler, Wulff, Stanley, Black, "A naturalistic open source movie for optical flow
/// evaluation", ECCV 2012), px per frame of 1/24 s at 1024 x 436.
///
/// Its benchmark publishes end-point errors of all pixels, and of those below 10, from 10 to 40, and above 40 px per
/// frame. The first is the mean of the others, weighted by the fractions of pixels, which follow from the results of
/// any three methods. The results of ten methods (docs/methods/dataset.md lists them) agree to 0.002 px on 59.3 %, 28.8
/// % and 11.9 %. The histogram is a log-normal distribution, truncated at 160 px, with these fractions.
MagnitudeHistogram sintel_magnitudes();

/// Reads lines "LOW HIGH WEIGHT" (px, px, any unit), in order and without gaps, from 0; # begins a comment. Throws
/// UserError with file and line.
MagnitudeHistogram read_magnitudes(const std::filesystem::path& file);

/// Half the sum of absolute differences of two histograms: the fraction of pixels that are in different bins, 0 to 1.
double total_variation(const std::vector<double>& a, const std::vector<double>& b);

}  // namespace esim::inline dataset
