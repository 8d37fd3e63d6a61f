#pragma once

namespace esim {

/// How the images of another program are asked for, where that is not found out by asking.

/// Light.
enum class EngineLight {
  automatic,  ///< NPY where it is offered, PNG otherwise
  png,        ///< 8 or 16 bits, sRGB
  npy,        ///< floats are linear, bytes sRGB
};

/// Depth, as NumPy arrays.
enum class EngineDepth {
  automatic,    ///< plane_depth where it is offered; otherwise as the program's version suggests
  plane_depth,  ///< of the image plane, m, by the command of this name
  ray_metres,   ///< the ray's length, m, by the command depth
  ray_centimetres,
  planar_metres,  ///< of the image plane, by the command depth
  planar_centimetres,
};

/// Which object each pixel sees.
enum class EngineMask {
  automatic,  ///< NPY where it is offered, PNG otherwise
  png,        ///< colours
  npy,        ///< colours, or numbers
  none,       ///< not asked: all is taken for standing still
};

}  // namespace esim
