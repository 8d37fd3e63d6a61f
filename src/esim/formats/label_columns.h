#pragma once

#include <array>
#include <cstdint>

#include "esim/events/event_label.h"

// Private to formats.
namespace esim::inline formats {

/// A column of labels in files, and the member that it holds. The others, t_ideal, cause and hot, are converted.
template <typename Number>
struct LabelColumn {
  const char* name;
  Number EventLabel::*member;
};

inline constexpr std::array<LabelColumn<float>, 4> kLabelParts{{{"signal", &EventLabel::signal},
                                                                {"flicker", &EventLabel::flicker},
                                                                {"noise", &EventLabel::noise},
                                                                {"leak", &EventLabel::leak}}};
inline constexpr std::array<LabelColumn<std::uint16_t>, 2> kLabelSurfaces{
    {{"object", &EventLabel::object}, {"semantic_class", &EventLabel::semantic_class}}};

/// The names of all columns.
inline constexpr std::array<const char*, 9> kLabelNames{"t_ideal", "signal",         "flicker", "noise", "leak",
                                                        "object",  "semantic_class", "cause",   "hot"};

}  // namespace esim::inline formats
