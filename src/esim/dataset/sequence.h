#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "esim/core/image.h"
#include "esim/core/time.h"
#include "esim/events/event.h"

namespace esim::inline dataset {

/// A vector for each pixel: x to the right, y downwards.
struct VectorField {
  Image<float> x, y;

  bool empty() const { return x.empty(); }
};

/// One labelled sequence of a dataset. Missing contents are empty.
struct Sequence {
  std::uint32_t index = 0;
  int width = 0, height = 0;
  TimeSpan span{};
  std::vector<Event> events{};

  TimeNs motion_field_t = 0;
  VectorField motion_field{};    ///< motion field at motion_field_t, px/s
  VectorField optical_flow{};    ///< optical flow from the start to the end, at the pixels of the start, px
  Image<float> first{}, last{};  ///< irradiance at the start and at the end
  Image<float> depth{};          ///< at the start, m; +inf without a surface

  std::string info{};                                ///< its random values, as JSON
  std::map<std::string, std::string> passed_over{};  ///< unusable images and the reasons
};

}  // namespace esim::inline dataset
