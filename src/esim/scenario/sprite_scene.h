#pragma once

#include <filesystem>
#include <vector>

#include "esim/scenario/scenario.h"

namespace esim {

/// What a scene file says.
struct SpriteSceneFile {
  int width = 0, height = 0;         ///< of the sensor, px
  std::vector<LayerOptions> layers;  ///< the nearest first; their keyframes are at 0 and at the file's duration
};

/// Reads a `.scene` file of the original ESIM: words separated by white space,
///     width height duration_s
/// and for each layer, the furthest first,
///     image median_px gaussian_px  rotation_deg x y scale_x scale_y
/// where each of the last five is a pair, at the start and at the end. Positions are fractions of the sensor's size;
/// at scale 1 the image fills the sensor. The furthest layer is mirrored beyond its edges, the others end there.
///
/// Images are looked for where the file says, seen from its folder; by file name beside it; by file name in the folders
/// of `search_path`. Throws UserError naming file and line for anything missing or out of range, and for an image that
/// is not found, what was tried.
SpriteSceneFile read_sprite_scene(const std::filesystem::path& file,
                                  const std::vector<std::filesystem::path>& search_path);

}  // namespace esim
