#include "esim/geometry/reconstruction/reconstruction.h"

#include <fmt/format.h>

#include <array>
#include <cmath>

#include "esim/core/error.h"
#include "esim/core/inputs/used_files.h"

namespace esim::inline geometry {
namespace {

namespace fs = std::filesystem;

constexpr const char* kTransforms = "transforms.json";

bool is_file(const fs::path& path) {
  std::error_code ignored;
  return fs::is_regular_file(path, ignored);
}

const char* name_of(ReconstructionPart part) { return part == ReconstructionPart::cameras ? "cameras" : "images"; }

std::optional<fs::path> find_in_model(const fs::path& folder, ReconstructionPart part) {
  for (const char* extension : {".bin", ".txt"}) {
    fs::path file = folder / (std::string(name_of(part)) + extension);
    if (is_file(file)) return file;
  }
  return std::nullopt;
}

ReconstructionFile find_in_folder(const fs::path& folder, ReconstructionPart part) {
  if (auto file = find_in_model(folder, part)) return {ReconstructionKind::colmap, *std::move(file)};
  if (is_file(folder / kTransforms)) return {ReconstructionKind::transforms, folder / kTransforms};
  throw UserError(fmt::format(
      "{}: the folder contains neither {}.bin nor {}.txt nor {}; name the folder of a COLMAP model, such as "
      "sparse/0, or a file",
      folder.string(), name_of(part), name_of(part), kTransforms));
}

}  // namespace

std::optional<ReconstructionFile> find_reconstruction(const fs::path& path, ReconstructionPart part) {
  std::error_code ignored;
  if (fs::is_directory(path, ignored)) return find_in_folder(path, part);
  if (!is_file(path)) return std::nullopt;
  const std::string stem = path.stem().string(), extension = path.extension().string();
  const auto lists_frames = [&] { return text_of_reconstruction(path).find("\"frames\"") != std::string::npos; };
  if (extension == ".json" && (part == ReconstructionPart::images || lists_frames()))
    return ReconstructionFile{ReconstructionKind::transforms, path};
  if (extension != ".bin" && extension != ".txt") return std::nullopt;
  if (stem == name_of(part)) return ReconstructionFile{ReconstructionKind::colmap, path};
  constexpr std::array<const char*, 3> kOthers{"cameras", "images", "points3D"};
  for (const char* other : kOthers) {
    if (stem == other) return find_in_folder(path.parent_path().empty() ? "." : path.parent_path(), part);
  }
  return std::nullopt;
}

Camera camera_of_corner(double width, double height, const Eigen::Vector2d& focal_lengths,
                        const Eigen::Vector2d& principal_point, const Distortion& distortion) {
  const auto side = [&](double pixels) {
    constexpr double kMaxSide = 16384;
    if (!(pixels >= 1 && pixels <= kMaxSide) || pixels != std::floor(pixels)) {
      throw UserError(fmt::format("the image size is {} x {} px; width and height must be positive integers up to {}",
                                  width, height, kMaxSide));
    }
    return static_cast<int>(pixels);
  };
  constexpr double kFirstCentre = 0.5;  // of a pixel, from the upper left corner of the image
  Camera camera{side(width),
                side(height),
                focal_lengths.x(),
                focal_lengths.y(),
                principal_point.x() - kFirstCentre,
                principal_point.y() - kFirstCentre,
                distortion};
  camera.validate();
  return camera;
}

std::string text_of_reconstruction(const fs::path& file) {
  constexpr std::uintmax_t kMaxBytes = std::uintmax_t{256} << 20;
  std::error_code error;
  const std::uintmax_t size = fs::file_size(file, error);
  std::ifstream in = open_input(file);
  if (error || !in)
    throw UserError(fmt::format("{}: cannot be read; check that it is a file, and its permissions", file.string()));
  if (size > kMaxBytes) {
    throw UserError(fmt::format("{}: has {} bytes, but at most {} are read; keep only the frames of one sequence",
                                file.string(), size, kMaxBytes));
  }
  std::string text(size, '\0');
  in.read(text.data(), static_cast<std::streamsize>(size));
  text.resize(static_cast<std::size_t>(in.gcount()));
  return text;
}

}  // namespace esim::inline geometry
