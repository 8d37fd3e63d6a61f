#pragma once

#include <concepts>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace esim::inline core {

/// An option whose values have names and are written as these, like an enumeration (core/describe.h). T::names() lists
/// the valid names. T::find(name) is the value of a name, unset for an invalid name, of which T::problem(name) may say
/// what is wrong.
template <typename T>
concept NamedValue = requires(const T& value, std::string_view name) {
  { value.name() } -> std::same_as<std::string>;
  { T::names() } -> std::same_as<std::vector<std::string>>;
  { T::find(name) } -> std::same_as<std::optional<T>>;
  { T::problem(name) } -> std::same_as<std::string>;
};

}  // namespace esim::inline core
