#pragma once

#include <optional>

#include "esim/record/format.h"

namespace esim::python {

/// Of both, or of neither: _checks.py sees to that.
inline std::optional<SensorSize> sensor_size(std::optional<int> width, std::optional<int> height) {
  if (!width || !height) return std::nullopt;
  return SensorSize{*width, *height};
}

}  // namespace esim::python
