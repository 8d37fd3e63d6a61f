#pragma once

#include "esim/core/error.h"

namespace esim::inline core {

/// An external program that renders the scene failed or answered incorrectly. What was simulated before is kept.
class EngineError : public UserError {
 public:
  using UserError::UserError;
};

}  // namespace esim::inline core
