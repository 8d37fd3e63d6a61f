#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "esim/dataset/magnitudes.h"
#include "esim/dataset/sequence.h"
#include "esim/record/preview/canvas.h"

namespace esim {

inline constexpr std::size_t kMostShown = 12;
inline constexpr const char* kPreviewName = "preview.png";
inline constexpr const char* kMagnitudesName = "magnitudes.png";

/// A contact sheet: of each sequence the image at its start, its events and its motion field side by side.
Image<Rgb> draw_sequences(std::span<const Sequence> sequences);

/// The share of pixels over the magnitude of their displacement, in `bins`: as counted, and where there is one, as in
/// the target that the bins are of. The last count is of those beyond the bins.
Image<Rgb> draw_magnitudes(const MagnitudeHistogram& bins, bool is_target, std::span<const std::uint64_t> counts);

/// Counts as shares of all of them, those beyond the bins left out.
std::vector<double> shares_of(std::span<const std::uint64_t> counts);

}  // namespace esim
