#pragma once

#include <optional>

#include "esim/recording/format.h"

namespace esim::python {

/// Width and height; _checks.py ensures that both or neither are given.
inline std::optional<SensorSize> sensor_size(std::optional<int> width, std::optional<int> height) {
  if (!width || !height) return std::nullopt;
  return SensorSize{*width, *height};
}

}  // namespace esim::python
