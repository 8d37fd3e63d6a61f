#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "esim/geometry/camera.h"

/// Files of programs that reconstruct a scene from images: models of COLMAP, and transforms.json.
namespace esim::inline geometry {

enum class ReconstructionKind { colmap, transforms };

/// A file that describes the images or the cameras of a reconstruction.
struct ReconstructionFile {
  ReconstructionKind kind = ReconstructionKind::colmap;
  std::filesystem::path file;
};

enum class ReconstructionPart { cameras, images };

/// The file that contains this part of a reconstruction. `path` is the folder of a COLMAP model (in which .bin is
/// preferred to .txt), one of the files in it, the folder of a transforms.json, or a .json file (for cameras, one
/// that lists frames). Empty for other files. Throws UserError for a folder, or a file of a model, without the part.
std::optional<ReconstructionFile> find_reconstruction(const std::filesystem::path& path, ReconstructionPart part);

/// A camera whose principal point is relative to the upper left corner of the image, where the centre of the first
/// pixel is (0.5, 0.5), as in these files; that of esim is relative to this pixel's centre. Throws UserError, without
/// naming the file, for sizes and parameters that are not valid.
Camera camera_of_corner(double width, double height, const Eigen::Vector2d& focal_lengths,
                        const Eigen::Vector2d& principal_point, const Distortion& distortion);

/// The complete content of a text file. Throws UserError if it cannot be read or is too large.
std::string text_of_reconstruction(const std::filesystem::path& file);

}  // namespace esim::inline geometry
