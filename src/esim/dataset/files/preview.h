#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "esim/dataset/generators/magnitudes.h"
#include "esim/dataset/sequence.h"
#include "esim/preview/colours.h"

namespace esim::inline dataset {

inline constexpr std::size_t kMaxShown = 12;
inline constexpr const char* kPreviewName = "preview.png";
inline constexpr const char* kMagnitudesName = "magnitudes.png";

/// A contact sheet with the initial image, the events and the motion field of each sequence side by side.
Image<Rgb> draw_sequences(std::span<const Sequence> sequences);

/// The fraction of pixels over the magnitude of optical flow, as counted in `bins`, and if `is_target` also that of
/// `bins` itself. The last count is of pixels beyond the bins.
Image<Rgb> draw_magnitudes(const MagnitudeHistogram& bins, bool is_target, std::span<const std::uint64_t> counts);

/// Counts as fractions of all; those beyond the bins are left out.
std::vector<double> fractions_of(std::span<const std::uint64_t> counts);

}  // namespace esim::inline dataset
