#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include "esim/evaluate/pixels.h"
#include "esim/evaluate/places.h"
#include "esim/sim/world.h"

namespace esim::inline evaluate {

/// The true brightness L = ln(E + log_eps) of some pixels of camera 0, rendered at start + k / rate and kept in blocks
/// of kBlock instants. If the blocks exceed the memory limit, the least recently used ones are dropped, and rendered
/// again when needed.
class ReferenceBrightness {
 public:
  static constexpr std::int64_t kBlock = 256;

  /// The world must outlive this object.
  ReferenceBrightness(const World& world, std::vector<PixelPosition> pixels, double rate_hz, double log_eps,
                      std::size_t memory_bytes);

  const std::vector<PixelPosition>& pixels() const { return pixels_; }
  double log_eps() const { return log_eps_; }

  std::int64_t instants() const { return instants_; }
  TimeNs time(std::int64_t k) const { return world_.info.start + to_ns(static_cast<double>(k) / rate_hz_); }
  /// The first instant after t.
  std::int64_t first_after(TimeNs t) const;

  /// L at the instants block * kBlock + j, one row per pixel; valid until the next call.
  const Image<float>& block(std::int64_t block);

  /// The places of the pixels at the same instants, in the same layout; empty unless all pixels are compared.
  const Image<Place>& places(std::int64_t block);
  std::int64_t blocks() const { return (instants_ + kBlock - 1) / kBlock; }

  /// Whether all blocks fit into memory.
  bool fits() const { return static_cast<std::size_t>(blocks()) <= capacity_; }

 private:
  struct Entry {
    Image<float> brightness;
    Image<Place> places;
    std::int64_t used = 0;
  };

  Entry& entry(std::int64_t block);
  void render(std::int64_t block, Entry& entry);

  const World& world_;
  std::vector<PixelPosition> pixels_;
  std::vector<Tile> tiles_;
  double rate_hz_, log_eps_;
  std::int64_t instants_;
  std::size_t capacity_;  // blocks
  std::map<std::int64_t, Entry> kept_;
  std::int64_t clock_ = 0;
  Sample sample_;
};

}  // namespace esim::inline evaluate
