#pragma once

#include <optional>

#include "esim/core/error.h"
#include "esim/record/format.h"

namespace esim::python {

/// Of both, or of neither. Throws UserError where one is missing.
inline std::optional<SensorSize> sensor_size(std::optional<int> width, std::optional<int> height) {
  if (width.has_value() != height.has_value()) throw UserError("give width and height of the sensor, or neither");
  if (!width) return std::nullopt;
  return SensorSize{*width, *height};
}

}  // namespace esim::python
