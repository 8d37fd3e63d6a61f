#pragma once

namespace esim::inline scene {

/// Which commands request the images of an external renderer, if this is not determined automatically.

/// Irradiance.
enum class EngineLight {
  automatic,  ///< NPY if it is offered, otherwise PNG
  png,        ///< 8 or 16 bits, sRGB
  npy,        ///< floats are linear, bytes are sRGB
};

/// Depth, as NumPy arrays.
enum class EngineDepth {
  automatic,    ///< plane_depth if it is offered; otherwise as implied by the program's version
  plane_depth,  ///< planar depth in m, from the command of this name
  ray_metres,   ///< length of the ray in m, from the command depth
  ray_centimetres,
  planar_metres,  ///< planar depth in m, from the command depth
  planar_centimetres,
};

/// Which object each pixel sees.
enum class EngineMask {
  automatic,  ///< NPY if it is offered, otherwise PNG
  png,        ///< colours
  npy,        ///< colours or numbers
  none,       ///< not requested: everything counts as static
};

}  // namespace esim::inline scene
