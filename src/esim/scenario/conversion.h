#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "esim/scenario/read.h"
#include "esim/scenario/schema.h"
#include "esim/sensors/event_camera.h"
#include "esim/video/frame_sequence.h"
#include "esim/video/interpolator.h"

namespace esim {

/// Everything that determines the conversion of a video to events, as values.
struct ConversionOptions {
  std::filesystem::path input;
  std::uint64_t seed = 0;
  VideoOptions video;
  InterpolationOptions interpolation;
  bool bayer = false;
  EventCameraOptions event_camera;
};

/// What `esim video` has an option of its own for.
template <class Visitor>
void describe_command_line(Visitor& visit, ConversionOptions& o) {
  visit("seed", o.seed, About{"seed of all random numbers"});
  describe(visit, o.video);
  describe(visit, o.interpolation);
  visit("bayer", o.bayer, About{"events of a colour sensor: RGGB filters, red at even columns and rows"});
}

template <class Visitor>
void describe(Visitor& visit, ConversionOptions& o) {
  visit("input", o.input, About{"video file, or folder of images"});
  describe_command_line(visit, o);
  visit("event_camera", o.event_camera, About{"the event sensor"});
}

template <>
inline constexpr std::array<const char*, 3> kEnumNames<Encoding>{"auto", "srgb", "linear"};

/// The event camera that "event_camera.key=value", or "key=value" for short, make of the default one. Throws UserError
/// with key and what would be right, beginning with `setter`.
EventCameraOptions read_event_camera(const std::vector<std::string>& overrides, const std::string& setter = kSetter);

/// A camera's options in full as YAML.
std::string write_event_camera(const EventCameraOptions& options);

/// The options in full as YAML.
std::string write_conversion(const ConversionOptions& options);

}  // namespace esim
