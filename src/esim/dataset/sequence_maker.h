#pragma once

#include <cstdint>
#include <string>

#include "esim/dataset/magnitudes.h"
#include "esim/dataset/sequence.h"

namespace esim {

/// What makes the sequences of a dataset.
class SequenceMaker {
 public:
  virtual ~SequenceMaker() = default;

  /// Everything that its sequences depend on, as JSON.
  virtual std::string options() const = 0;

  /// In whose bins magnitudes of displacement are counted, and with which they are compared if it `is_target()`.
  virtual const MagnitudeHistogram& magnitudes() const = 0;
  virtual bool is_target() const = 0;

  /// A function of the options and the index alone. Any number of threads may call it.
  virtual Sequence make(std::uint32_t index) const = 0;
};

}  // namespace esim
