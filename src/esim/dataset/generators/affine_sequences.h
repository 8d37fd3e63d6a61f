#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "esim/core/describe.h"
#include "esim/dataset/generators/affine_motion.h"
#include "esim/dataset/generators/magnitudes.h"
#include "esim/dataset/sequence_maker.h"
#include "esim/event_camera/options.h"
#include "esim/sampling/options.h"
#include "esim/scenario/scenario.h"

namespace esim::inline dataset {

/// The time of the motion field.
enum class MotionFieldTime { start, middle, end };
}  // namespace esim::inline dataset

namespace esim {

template <>
inline constexpr std::array<const char*, 3> kEnumNames<MotionFieldTime>{"start", "middle", "end"};

}  // namespace esim

namespace esim::inline dataset {

struct Range {
  double low = 0, high = 0;
};

struct AffineOptions {
  std::filesystem::path images{};  ///< a folder; empty: dead leaves
  int width = 240, height = 180;   ///< px
  double duration_s = 0.04;
  std::uint64_t seed = 1;
  MagnitudeHistogram magnitudes = sintel_magnitudes();  ///< of the optical flow over the duration
  double flow_scale = 1;                                ///< factor on the magnitudes
  MotionMix mix{};
  MotionFieldTime motion_field_at = MotionFieldTime::middle;
  Range contrast_threshold{0.2, 0.5};  ///< C+ = C-, random for each sequence
  EventCameraOptions event_camera{};   ///< all other options
  SamplingOptions sampling = FlowSampling{};
  std::uint32_t sensors = 1;  ///< consecutive sequences of the same motion, with other thresholds and seeds
};

/// Random affine motions of images over the sensor, with events and exact optical flow: the dataset of the paper's
/// Section 5. A sequence is a function of the options and its index. Any number of threads may make sequences.
class AffineSequences final : public SequenceMaker {
 public:
  /// Throws UserError for invalid options, and for a folder without images.
  explicit AffineSequences(AffineOptions options);
  ~AffineSequences() override;

  std::string options() const override;
  const MagnitudeHistogram& magnitudes() const override { return options_.magnitudes; }
  bool is_target() const override { return true; }

  std::uint32_t sensors() const override { return options_.sensors; }

  /// The sequences from 0 to the duration. Throws UserError if no image is usable.
  std::vector<Sequence> make_all(std::uint32_t rendering) const override;

 private:
  struct Impl;

  /// The event sensor of a sequence.
  SensorOptions draw_sensor(std::uint32_t index) const;

  AffineOptions options_;
  std::unique_ptr<const Impl> impl_;
};

}  // namespace esim::inline dataset
