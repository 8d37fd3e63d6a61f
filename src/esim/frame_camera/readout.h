#pragma once

#include <cstdint>

#include "esim/core/image.h"
#include "esim/core/parallel.h"
#include "esim/core/pixel_normals.h"
#include "esim/core/random.h"
#include "esim/frame_camera/camera_response.h"
#include "esim/frame_camera/options.h"

// Private to frame_camera.
namespace esim::inline frame_camera {

/// Converts irradiance to digital numbers: electrons, full well, noise, gain, response and quantisation.
class FrameReadout {
 public:
  FrameReadout(const FrameCameraOptions& options, std::uint64_t seed, std::uint16_t stream);

  /// Reads frame `number` from the mean irradiance over an exposure of `exposure` times exposure_s. `numbers` must have
  /// the image's size.
  void read(const Image<float>& irradiance, double exposure, std::int64_t number, const Workers& workers,
            Image<std::uint16_t>& numbers) const;

  /// Mean level of an image, 0 at the black level and 1 at full scale; not below 0.
  double mean_level(const Image<std::uint16_t>& numbers) const;

  /// The signal that the response maps to a level.
  double signal_of(double level) const { return response_.inverse(level); }

 private:
  struct Block;
  void read_block(Block& block, std::size_t first, std::uint32_t number, double electrons_per_irradiance,
                  const float* irradiance, std::uint16_t* numbers) const;

  FrameCameraOptions options_;
  CameraResponse response_;
  AddressedRandom random_;
};

/// Maps a standard normal deviate monotonically to a Poisson-distributed number with this mean.
float poisson(float mean, float normal);

}  // namespace esim::inline frame_camera
