#include "esim/filters/chip_blocks.h"

#include <fmt/format.h>

#include <array>

namespace esim::inline filters {
namespace {

constexpr std::size_t kFilters = 5;
constexpr std::array<const char*, kFilters> kNames{"region", "activity", "anti_flicker", "trail", "rate_controller"};

struct Chip {
  std::string_view name;
  std::array<bool, kFilters> has;  // in the order of kNames
};

// Prophesee's sensors: the availability of each facility in the documentation of Metavision SDK 5.2, "HAL Facilities
// API". The others: the filters that libcaer configures in the camera; a DAVIS has a region and single masked pixels, a
// DVXplorer a cropper and an activity decision.
constexpr Chip kChips[] = {
    {"dvs128", {false, false, false, false, false}},    //
    {"davis240c", {true, false, false, false, false}},  //
    {"davis346", {true, false, false, false, false}},   //
    {"dvxplorer", {true, true, false, false, false}},   //
    {"gen3.1-vga", {true, true, false, false, false}},  //
    {"gen4.1", {true, false, true, true, true}},        //
    {"imx636", {true, false, true, true, true}},        //
    {"genx320", {true, true, true, true, true}},
};

const Chip* find_chip(std::string_view name) {
  for (const Chip& chip : kChips) {
    if (chip.name == name.substr(0, name.find('@'))) return &chip;
  }
  return nullptr;
}

std::string sensors_with(std::size_t filter) {
  std::string names;
  for (const Chip& chip : kChips) {
    if (chip.has[filter]) names += fmt::format("{}{}", names.empty() ? "" : ", ", chip.name);
  }
  return names;
}

}  // namespace

std::vector<std::string> missing_blocks(const FilterOptions& options, std::string_view sensor) {
  const Chip* const chip = find_chip(sensor);
  if (chip == nullptr) return {};
  const std::array<bool, kFilters> used{options.region.has_value(), options.activity.has_value(),
                                        options.anti_flicker.has_value(), options.trail.has_value(),
                                        options.rate_controller.has_value()};
  std::vector<std::string> lines;
  for (std::size_t i = 0; i < kFilters; ++i) {
    if (!used[i] || chip->has[i]) continue;
    lines.push_back(fmt::format("{}: the {} has no such filter, but these have: {}; it is applied anyway", kNames[i],
                                chip->name, sensors_with(i)));
  }
  return lines;
}

}  // namespace esim::inline filters
