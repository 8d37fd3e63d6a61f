#include "esim/recording/format.h"

#include <type_traits>

namespace esim::inline recording {

Content content_of(const Record& record) {
  const auto kind = [](const auto& alternative) {
    using Kind = std::decay_t<decltype(alternative)>;
    if constexpr (std::is_same_v<Kind, EventsRecord>) return Content::events;
    if constexpr (std::is_same_v<Kind, FrameRecord>) return Content::frames;
    if constexpr (std::is_same_v<Kind, ImageRecord>) return Content::images;
    if constexpr (std::is_same_v<Kind, ImuRecord>) return Content::imu;
    if constexpr (std::is_same_v<Kind, PoseRecord>) return Content::poses;
    if constexpr (std::is_same_v<Kind, TruthRecord>) return Content::truth;
    if constexpr (std::is_same_v<Kind, OpticalFlowRecord>) return Content::optical_flow;
    if constexpr (std::is_same_v<Kind, EventPointsRecord>) return Content::event_points;
    if constexpr (std::is_same_v<Kind, TriggerRecord>) return Content::triggers;
  };
  return std::visit(kind, record);
}

std::string_view describe(Content content) {
  switch (content) {
    case Content::events:
      return "events";
    case Content::event_labels:
      return "labels of events";
    case Content::frames:
      return "frames";
    case Content::images:
      return "images";
    case Content::imu:
      return "IMU measurements";
    case Content::poses:
      return "poses";
    case Content::truth:
      return "ground-truth frames";
    case Content::optical_flow:
      return "optical flow";
    case Content::event_points:
      return "event points";
    case Content::triggers:
      return "triggers";
  }
  return "";
}

}  // namespace esim::inline recording
