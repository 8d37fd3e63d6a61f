#pragma once

#include <optional>
#include <string>

#include "esim/sampling/sampler.h"

namespace esim::test {

/// A result that only one sampling method has; empty if no result has this name and type.
template <typename T>
std::optional<T> named_result(const SamplingStatistics& statistics, const std::string& name) {
  for (const NamedResult& result : statistics.others) {
    if (const T* const value = std::get_if<T>(&result.value); value != nullptr && result.name == name) return *value;
  }
  return std::nullopt;
}

}  // namespace esim::test
