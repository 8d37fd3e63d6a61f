#pragma once

#include "esim/scenario/scenario.h"

namespace esim::python {

/// A scenario that has been read and checked.
struct CheckedScenario {
  Scenario value;
};

}  // namespace esim::python
