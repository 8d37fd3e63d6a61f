#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "esim/event_camera/event_camera.h"
#include "esim/scenario/read.h"
#include "esim/scenario/schema.h"
#include "esim/video/frame_sequence.h"
#include "esim/video/interpolator.h"

namespace esim::inline scenario {

/// All options of a conversion of a video to events.
struct ConversionOptions {
  std::filesystem::path input;
  std::uint64_t seed = 0;
  VideoOptions video;
  InterpolationOptions interpolation;
  std::string interpolator{};  ///< path of a model in ONNX, or the name of a function; empty: along the optical flow
  bool bayer = false;
  EventCameraOptions event_camera;
};

/// Options that `esim video` has on its command line.
template <class Visitor>
void describe_command_line(Visitor& visit, ConversionOptions& o) {
  visit("seed", o.seed, About{"seed of all random numbers"});
  describe(visit, o.video);
  describe(visit, o.interpolation);
  visit("bayer", o.bayer, About{"simulate a colour sensor: RGGB filters, red at even columns and rows"});
}

template <class Visitor>
void describe(Visitor& visit, ConversionOptions& o) {
  visit("input", o.input, About{"video file, or folder of images"});
  describe_command_line(visit, o);
  visit("interpolator", o.interpolator,
        About{"what makes the images between frames in place of the optical flow: a model in ONNX"});
  visit("event_camera", o.event_camera, About{"the event sensor"});
}

}  // namespace esim::inline scenario

namespace esim {

template <>
inline constexpr std::array<const char*, 3> kEnumNames<Encoding>{"auto", "srgb", "linear"};

}  // namespace esim

namespace esim::inline scenario {

/// The default event camera with overrides "event_camera.key=value", or "key=value" for short. Throws UserError, which
/// begins with `setter`, with the key and the valid values.
EventCameraOptions read_event_camera(const std::vector<std::string>& overrides, const std::string& setter = kSetter);

/// The default camera with overrides "camera.key=value" of its size and its lens. Throws UserError as above.
Camera read_camera(const std::vector<std::string>& overrides);

/// A camera's options in full as YAML.
std::string write_event_camera(const EventCameraOptions& options);

/// The options in full as YAML.
std::string write_conversion(const ConversionOptions& options);

}  // namespace esim::inline scenario
