#include "esim/recording/adapters.h"

namespace esim::inline recording {

void OneCamera::begin(const RecordingInfo& info) {
  RecordingInfo one = info;
  one.cameras = {info.cameras.at(static_cast<std::size_t>(camera_))};
  const CameraInfo& sensor = info.cameras.at(static_cast<std::size_t>(sensor_));
  one.cameras[0].name = sensor.name;
  one.cameras[0].has_labels = sensor.has_labels;
  inner_->begin(one);
}

void OneCamera::write(const Record& record) {
  const auto pass_on = [&]<typename Kind>(const Kind& alternative) {
    if constexpr (requires { alternative.camera; }) {
      constexpr bool kOfEvents = requires { alternative.events; };
      if (alternative.camera != (kOfEvents ? sensor_ : camera_)) return;
      Kind of_the_only_one = alternative;
      of_the_only_one.camera = 0;
      inner_->write(of_the_only_one);
    } else {
      inner_->write(record);
    }
  };
  std::visit(pass_on, record);
}

void FromZero::begin(const RecordingInfo& info) {
  RecordingInfo shifted = info;
  start_ = info.start;
  shifted.start = 0, shifted.end = info.end - start_;
  inner_->begin(shifted);
}

void FromZero::write(const Record& record) {
  const auto pass_on = [&]<typename Kind>(Kind shifted) {
    if constexpr (requires { shifted.t; }) shifted.t -= start_;
    if constexpr (requires { shifted.exposure_start; }) shifted.exposure_start -= start_;
    if constexpr (requires { shifted.t0; }) shifted.t0 -= start_, shifted.t1 -= start_;
    if constexpr (requires { shifted.events; }) {
      events_.assign(shifted.events.begin(), shifted.events.end());
      for (Event& event : events_) event.t -= start_;
      shifted.events = events_;
    }
    if constexpr (requires { shifted.labels; }) {
      labels_.assign(shifted.labels.begin(), shifted.labels.end());
      for (EventLabel& label : labels_) label.t_ideal -= start_;
      shifted.labels = labels_;
    }
    inner_->write(shifted);
  };
  std::visit(pass_on, record);
}

}  // namespace esim::inline recording
