#pragma once

#include "esim/scenario/scenario.h"

namespace esim::python {

/// A valid scenario.
struct CheckedScenario {
  Scenario value;
};

}  // namespace esim::python
