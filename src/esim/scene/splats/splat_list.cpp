#include "esim/scene/splats/splat_list.h"

#include <fmt/format.h>

#include <bit>
#include <cmath>
#include <utility>

#include "esim/core/error.h"

namespace esim::inline scene {
namespace {

constexpr std::uint64_t kMaxSplatsPerByte = 16, kSmall = 64;
constexpr float kMaxDeviation = 1e6F;  // m

/// Of `count` numbers. Without an early exit, so that it vectorises.
bool all_finite(const float* numbers, std::size_t count) {
  constexpr std::uint32_t kExponent = 0x7F800000;
  std::uint32_t bad = 0;
  for (std::size_t i = 0; i < count; ++i)
    bad |= (std::bit_cast<std::uint32_t>(numbers[i]) & kExponent) == kExponent ? 1U : 0U;
  return bad == 0;
}

bool is_valid(const Splat& splat, std::size_t numbers, float norm) {
  return splat.position.allFinite() && splat.deviation.allFinite() && splat.deviation.minCoeff() >= 0 &&
         splat.deviation.maxCoeff() <= kMaxDeviation && std::isfinite(norm) && norm > 1e-9F && splat.opacity >= 0 &&
         splat.opacity <= 1 && all_finite(splat.harmonics.data(), numbers);
}

}  // namespace

SplatList::SplatList(std::filesystem::path file, int degree, std::uint64_t count, std::uint64_t file_bytes)
    : file_(std::move(file)) {
  check_splat_count(file_, count, file_bytes);
  splats_.degree = degree;
  splats_.positions.reserve(count);
  splats_.deviations.reserve(count);
  splats_.rotations.reserve(count);
  splats_.opacities.reserve(count);
  splats_.harmonics.reserve(count * coefficients() * 3);
}

void SplatList::add(const Splat& splat) {
  const std::size_t numbers = coefficients() * 3;
  const float norm = splat.rotation.norm();
  if (!is_valid(splat, numbers, norm)) {
    ++dropped_;
    return;
  }
  splats_.positions.push_back(splat.position);
  splats_.deviations.push_back(splat.deviation);
  splats_.rotations.emplace_back(splat.rotation / norm);
  splats_.opacities.push_back(splat.opacity);
  splats_.harmonics.insert(splats_.harmonics.end(), splat.harmonics.begin(),
                           splat.harmonics.begin() + static_cast<std::ptrdiff_t>(numbers));
}

Splats SplatList::finish(const WarningHandler& warn) {
  const std::size_t all = splats_.size() + dropped_;
  if (all == 0) fail_splats(file_, "contains no splats; export it again");
  if (splats_.size() == 0)
    fail_splats(file_, fmt::format("is damaged: all {} splats are invalid; export it again", all));
  if (dropped_ > 0)
    warn(fmt::format("splats {}: {} of {} splats are dropped: they have numbers that are not finite or out of range",
                     file_.string(), dropped_, all));
  return std::move(splats_);
}

float sigmoid(float x) { return 1 / (1 + std::exp(-x)); }

void check_splat_count(const std::filesystem::path& file, std::uint64_t count, std::uint64_t file_bytes) {
  if (count > kSmall && (count - kSmall) / kMaxSplatsPerByte > file_bytes)
    fail_splats(file, fmt::format("is damaged: it cannot hold {} splats in {} bytes", count, file_bytes));
}

void fail_splats(const std::filesystem::path& file, const std::string& reason) {
  throw UserError(fmt::format("splats {}: {}", file.string(), reason));
}

void fail_triangles(const std::filesystem::path& file) {
  fail_splats(file, "contains triangles, not Gaussian splats; use the renderer 'mesh' for it");
}

void warn_of_degree(const std::filesystem::path& file, int degree, const WarningHandler& warn) {
  warn(fmt::format("splats {}: has spherical harmonics of degree {}; those above {} are ignored", file.string(), degree,
                   kMaxSplatDegree));
}

}  // namespace esim::inline scene
