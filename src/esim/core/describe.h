#pragma once

#include <array>
#include <limits>

namespace esim {

/// What a user may need to know of an option. Every struct of options has a function template
/// `template <class Visitor> void describe(Visitor& visit, Options& options)`
/// that calls visit("name", options.name, About{...}) for each of its members: the one place where the option's
/// name, unit, range and help stand. Reading and writing scenarios, checking them and documenting them all come
/// from it; the default is the member's initial value.
struct About {
  const char* help = "";
  const char* unit = "";
  double min = -std::numeric_limits<double>::infinity();
  double max = std::numeric_limits<double>::infinity();
  bool above_min = false;  ///< the minimum itself is not allowed
};

/// An enumeration among the options has a specialisation with its values' names as they are written, in order.
template <typename Enum>
inline constexpr std::array<const char*, 0> kEnumNames{};

}  // namespace esim
