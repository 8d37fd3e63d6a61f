#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <variant>

#include "esim/core/describe.h"

namespace esim::inline frame_camera {

/// Conversion of the signal to a level: both 0 in the dark and 1 at full scale.
struct LinearResponse {
  static constexpr const char* kType = "linear";
};
/// level = signal^(1 / gamma)
struct GammaResponse {
  static constexpr const char* kType = "gamma";
  double gamma = 2.2;
};
/// Measured: linear interpolation between the points of a file.
struct MeasuredResponse {
  static constexpr const char* kType = "measured";
  std::filesystem::path path;
};
using ResponseOptions = std::variant<LinearResponse, GammaResponse, MeasuredResponse>;

/// Each exposure is that of two frames earlier, times the factor that would have given that frame the target mean
/// level.
struct AutoExposureOptions {
  double target = 0.4;
  double min_exposure_s = 1e-4;
  std::optional<double> max_exposure_s{};  ///< default: the frame interval
};

/// Parameters of a frame camera; docs/frames.md gives the formulae.
struct FrameCameraOptions {
  double rate_hz = 30;
  double exposure_s = 0.01;
  double line_delay_s = 0;
  std::optional<AutoExposureOptions> auto_exposure{};

  double saturation_irradiance = 1;
  double full_well_e = 10000;
  bool shot_noise = false;
  double read_noise_e = 0;
  double gain = 1;
  ResponseOptions response{};
  double black_level = 0;
  int bits = 8;
  bool demosaic = true;

  int largest_number() const { return (1 << bits) - 1; }
};

template <class Visitor>
void describe(Visitor&, LinearResponse&) {}

template <class Visitor>
void describe(Visitor& visit, GammaResponse& o) {
  visit("gamma", o.gamma, About{"level = signal^(1 / gamma)", "", 0.1, 10});
}

template <class Visitor>
void describe(Visitor& visit, MeasuredResponse& o) {
  visit("path", o.path,
        About{"text file, one point per line: signal and level; both increase, and the last point is full scale"});
}

template <class Visitor>
void describe(Visitor& visit, AutoExposureOptions& o) {
  visit("target", o.target, About{"target mean level over the image, 1 = full scale", "", 0.001, 0.999});
  visit("min_exposure_s", o.min_exposure_s, About{"shortest exposure", "s", 1e-7, 1e4});
  visit("max_exposure_s", o.max_exposure_s, About{"longest exposure (default: the frame interval)", "s", 1e-7, 1e4});
}

template <class Visitor>
void describe(Visitor& visit, FrameCameraOptions& o) {
  visit("rate_hz", o.rate_hz, About{"frames per second, centred on start + k / rate_hz", "Hz", 1e-4, 1e5});
  visit("exposure_s", o.exposure_s,
        About{"exposure time; with auto_exposure, that of the first frame", "s", 1e-7, 1e4});
  visit("line_delay_s", o.line_delay_s,
        About{"delay from a row's exposure to the next row's; 0: global shutter", "s", 0, 1});
  visit("auto_exposure", o.auto_exposure,
        About{"adapts the exposure to a target mean level of the image (default: none)"});
  visit("saturation_irradiance", o.saturation_irradiance,
        About{"irradiance that fills a pixel within exposure_s", "", 1e-9, 1e9});
  visit("full_well_e", o.full_well_e, About{"maximum number of electrons in a pixel", "e-", 1, 1e9});
  visit("shot_noise", o.shot_noise, About{"the number of electrons is Poisson-distributed"});
  visit("read_noise_e", o.read_noise_e, About{"standard deviation of the read noise", "e-", 0, 1e6});
  visit("gain", o.gain, About{"1: a full pixel is at full scale; 2: a half-full pixel is", "", 0.001, 1000});
  visit("response", o.response, About{"conversion of the signal to a level, both 1 at full scale"});
  visit("black_level", o.black_level, About{"digital number in the dark", "DN", 0, 65534});
  visit("bits", o.bits, About{"bits of a digital number; more than 8 are written as 16-bit PNG", "", 8, 16});
  visit("demosaic", o.demosaic, About{"colour cameras: true writes frames in colour, false the raw mosaic"});
}

}  // namespace esim::inline frame_camera
