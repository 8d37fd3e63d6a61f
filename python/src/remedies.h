#pragma once

#include <string>

#include "esim/core/remedy.h"

namespace esim::python {

/// A message with the argument in Python that brings the remedy.
std::string with_remedy(const std::string& message, Remedy remedy);

}  // namespace esim::python
