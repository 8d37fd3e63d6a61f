#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "esim/dataset/randomise.h"
#include "esim/dataset/sequence_maker.h"

namespace esim {

/// Sequences of a scenario, with options that are drawn for each of them (docs/dataset.md). The scenario's one camera
/// is simulated from start to end. Ground truth is that of the first and of the last instant: the motion field at the
/// end, the displacement from the one to the other, depth at the start, images of both. A sequence is a function of the
/// scenario, the seed and its index; `seed` of the scenario is drawn, unless `randomise` names it.
class ScenarioSequences final : public SequenceMaker {
 public:
  /// `overrides` are "key=value" as of `--set`. Throws UserError for a scenario that cannot be read, of which the first
  /// sequence serves as a sample, for several cameras, and for ground truth that the renderer does not have.
  ScenarioSequences(const std::filesystem::path& file, std::vector<std::string> overrides, std::uint64_t seed,
                    bool displacement);

  std::string options() const override;
  const MagnitudeHistogram& magnitudes() const override { return magnitudes_; }
  bool is_target() const override { return false; }
  Sequence make(std::uint32_t index) const override;

 private:
  /// What is set for a sequence, as "key=value".
  std::vector<std::string> drawn(std::uint32_t index) const;

  std::filesystem::path file_;
  ScenarioTemplate template_;
  std::vector<std::string> overrides_;
  std::uint64_t seed_;
  bool displacement_;
  MagnitudeHistogram magnitudes_;
};

}  // namespace esim
