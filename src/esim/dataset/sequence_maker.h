#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "esim/dataset/generators/magnitudes.h"
#include "esim/dataset/sequence.h"

namespace esim::inline dataset {

/// The source of the sequences of a dataset.
class SequenceMaker {
 public:
  virtual ~SequenceMaker() = default;

  /// All options on which the sequences depend, as JSON.
  virtual std::string options() const = 0;

  /// The bins in which magnitudes of optical flow are counted; if `is_target()`, also the distribution to compare with.
  virtual const MagnitudeHistogram& magnitudes() const = 0;
  virtual bool is_target() const = 0;

  /// The number of consecutive sequences that are rendered once and sensed by different event sensors.
  virtual std::uint32_t sensors() const { return 1; }

  /// The sequences of one rendering, in order: those from rendering * sensors() on. A function of the options and the
  /// number of the rendering only. Safe to call from several threads.
  virtual std::vector<Sequence> make_all(std::uint32_t rendering) const = 0;

  /// The sequence of an index.
  Sequence make(std::uint32_t index) const { return std::move(make_all(index / sensors())[index % sensors()]); }
};

}  // namespace esim::inline dataset
