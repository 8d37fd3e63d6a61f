#pragma once

#include <cstdint>
#include <string>

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

  /// A function of the options and the index only. Safe to call from several threads.
  virtual Sequence make(std::uint32_t index) const = 0;
};

}  // namespace esim::inline dataset
