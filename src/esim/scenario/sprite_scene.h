#pragma once

#include <filesystem>
#include <vector>

#include "esim/scenario/scenario.h"

namespace esim::inline scenario {

/// The contents of a .scene file.
struct SpriteSceneFile {
  int width = 0, height = 0;           ///< of the sensor, px
  std::vector<SpriteOptions> sprites;  ///< the nearest first; their poses are at 0 and at the file's duration
};

/// Reads a `.scene` file of the original ESIM: words separated by white space,
///     width height duration_s
/// and for each sprite, the furthest first,
///     image median_px gaussian_px  rotation_deg x y scale_x scale_y
/// where each of the last five is a pair of values, at the start and at the end. Positions are fractions of the
/// sensor's size; at scale 1 the image fills the sensor. The furthest sprite is mirrored beyond its edges; the others
/// end there.
///
/// Looks for images at the path in the file, relative to its folder; then by file name in that folder; then by file
/// name in the folders of `search_path`. Throws UserError with file and line if a value is missing or out of range, and
/// with the paths that were tried if an image is not found.
SpriteSceneFile read_sprite_scene(const std::filesystem::path& file,
                                  const std::vector<std::filesystem::path>& search_path);

}  // namespace esim::inline scenario
