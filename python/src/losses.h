#pragma once

#include <string>
#include <vector>

#include "esim/sim/simulate.h"

namespace esim::python {

/// A line for people on each thing that a simulation lost, with what governs it; none where it lost nothing.
std::vector<std::string> losses(const Summary& summary);

}  // namespace esim::python
