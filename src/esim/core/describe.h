#pragma once

#include <array>
#include <limits>

namespace esim::inline core {

/// The description of an option. Every struct of options has a function template
/// `template <class Visitor> void describe(Visitor& visit, Options& options)`
/// that calls visit("name", options.name, About{...}) for each of its members. This is the only place that defines the
/// option's name, unit, range and help. Scenarios are read, written, checked and documented with it; the default is the
/// member's initial value.
struct About {
  const char* help = "";
  const char* unit = "";
  double min = -std::numeric_limits<double>::infinity();
  double max = std::numeric_limits<double>::infinity();
  bool above_min = false;  ///< the value must be greater than `min`
};

/// The names of an option's enumerators as they are written, in order; specialised for each enumeration.
template <typename Enum>
inline constexpr std::array<const char*, 0> kEnumNames{};

}  // namespace esim::inline core
