#pragma once

#include <string>

#include "esim/core/remedy.h"

namespace esim::python {

/// A message followed by the Python argument that solves the problem.
std::string with_remedy(const std::string& message, Remedy remedy);

}  // namespace esim::python
