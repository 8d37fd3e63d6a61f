#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "esim/dataset/generators/randomise.h"
#include "esim/dataset/sequence_maker.h"

namespace esim::inline dataset {

/// Sequences of a scenario, with random options for each of them (docs/dataset.md). The scenario has one camera and is
/// simulated from start to end. Ground truth is given for the first and the last instant: the motion field at the end,
/// the optical flow from start to end, depth at the start, images of both. A sequence depends on the scenario, the seed
/// and its index only. The scenario's `seed` is random unless `randomise` contains it.
class ScenarioSequences final : public SequenceMaker {
 public:
  /// `overrides` are "key=value" as for `--set`. Throws UserError if the scenario cannot be read (tested with the first
  /// sequence), if it has several cameras, and for ground truth that the renderer does not support.
  ScenarioSequences(const std::filesystem::path& file, std::vector<std::string> overrides, std::uint64_t seed,
                    bool optical_flow);

  std::string options() const override;
  const MagnitudeHistogram& magnitudes() const override { return magnitudes_; }
  bool is_target() const override { return false; }
  Sequence make(std::uint32_t index) const override;

 private:
  /// The overrides of a sequence, as "key=value".
  std::vector<std::string> drawn(std::uint32_t index) const;

  std::filesystem::path file_;
  ScenarioTemplate template_;
  std::vector<std::string> overrides_;
  std::uint64_t seed_;
  bool optical_flow_;
  MagnitudeHistogram magnitudes_;
};

}  // namespace esim::inline dataset
