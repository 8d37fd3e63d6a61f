#pragma once

#include "esim/core/error.h"

namespace esim {

/// Another program that shows the scene does not answer as it should. What was simulated until then is worth keeping.
class EngineError : public UserError {
 public:
  using UserError::UserError;
};

}  // namespace esim
