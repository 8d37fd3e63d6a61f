#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "esim/dataset/generators/randomise.h"
#include "esim/dataset/sequence_maker.h"
#include "esim/scenario/scenario.h"

namespace esim::inline dataset {

/// Sequences of a scenario, with random options for each of them (docs/dataset.md). The scenario has one camera and is
/// simulated from start to end. Ground truth is given for the first and the last instant: the motion field at the end,
/// the optical flow from start to end, depth at the start, images of both. A sequence depends on the scenario, the seed
/// and its index only. The scenario's `seed` is random unless `randomise` contains it. If the camera has several event
/// sensors, each makes a sequence of the same rendering.
class ScenarioSequences final : public SequenceMaker {
 public:
  /// `overrides` are "key=value" as for `--set`. With more than one of `sensors`, the camera has that many event
  /// sensors, which draw the random options of `event_camera` independently. Throws UserError if the scenario cannot be
  /// read (tested with the first sequence), if it has several cameras, and for ground truth that the renderer does not
  /// support.
  ScenarioSequences(const std::filesystem::path& file, std::vector<std::string> overrides, std::uint64_t seed,
                    bool optical_flow, std::uint32_t sensors = 1);

  std::string options() const override;
  const MagnitudeHistogram& magnitudes() const override { return magnitudes_; }
  bool is_target() const override { return false; }
  std::uint32_t sensors() const override { return sensors_; }
  std::vector<Sequence> make_all(std::uint32_t rendering) const override;

 private:
  bool is_drawn_by_sensors(const RandomOption& option) const;

  /// The overrides of a rendering, as "key=value".
  std::vector<std::string> drawn(std::uint32_t rendering) const;

  /// The scenario of a rendering.
  Scenario scenario_of(const std::vector<std::string>& drawn) const;

  std::filesystem::path file_;
  ScenarioTemplate template_;
  std::vector<std::string> overrides_;
  std::uint64_t seed_;
  bool optical_flow_;
  std::uint32_t wanted_sensors_;
  std::uint32_t sensors_ = 1;  // of the camera
  MagnitudeHistogram magnitudes_;
};

}  // namespace esim::inline dataset
