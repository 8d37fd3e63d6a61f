#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "esim/core/image.h"
#include "esim/core/time.h"
#include "esim/events/event.h"

namespace esim {

/// A vector for each pixel: x to the right, y downwards.
struct VectorField {
  Image<float> x, y;

  bool empty() const { return x.empty(); }
};

/// One labelled sequence of a dataset. What it does not have is empty.
struct Sequence {
  std::uint32_t index = 0;
  int width = 0, height = 0;
  TimeSpan span{};
  std::vector<Event> events{};

  TimeNs flow_t = 0;
  VectorField flow{};            ///< motion field at flow_t, px/s
  VectorField displacement{};    ///< of the points that the pixels see at the start, until the end, px
  Image<float> first{}, last{};  ///< irradiance at the start and at the end
  Image<float> depth{};          ///< at the start, m; +inf where nothing is seen

  std::string info{};                                ///< what was drawn for it, as JSON
  std::map<std::string, std::string> passed_over{};  ///< what was drawn, but could not be used, and why
};

}  // namespace esim
