// PLY files of Gaussian splats: as the original 3D Gaussian splatting writes them (Kerbl et al., 2023), and as
// PlayCanvas compresses them.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "esim/scene/splats/ply_file.h"
#include "esim/scene/splats/splat_list.h"
#include "esim/scene/splats/splat_readers.h"

namespace esim::inline scene {
namespace {

constexpr std::uint64_t kSplatsPerChunk = 256;

/// What the comments of a header say of how the model was trained: "SplatRenderMode: default|mip|2dgs" (Brush),
/// "antialiased 0|1" (Postshot), "esim_light linear" (esim).
void read_comments(const PlyHeader& header, SplatList& list) {
  for (std::string comment : header.comments) {
    std::transform(comment.begin(), comment.end(), comment.begin(),
                   [](unsigned char c) { return c < 0x80 ? static_cast<char>(std::tolower(c)) : '?'; });
    comment.erase(0, comment.find_first_not_of(" \t"));
    comment.erase(comment.find_last_not_of(" \t\r") + 1);
    if (comment == "splatrendermode: mip") list.set_filter(SplatFilter::mip);
    if (comment == "antialiased 1") list.set_filter(SplatFilter::antialiased);
    if (comment == "esim_light linear") list.set_light(SplatLight::linear);
  }
}

/// The number of properties f_rest_0, f_rest_1, ... of an element.
std::size_t count_rest(const PlyElement& element) {
  std::size_t count = 0;
  for (const PlyProperty& property : element.properties) count += property.name.starts_with("f_rest_") ? 1 : 0;
  return count;
}

/// The degree of harmonics with so many coefficients of degree 1 and higher, of three colours.
int degree_of_rest(const std::filesystem::path& file, std::size_t rest) {
  for (int degree = 0; degree <= 4; ++degree) {
    if (rest == static_cast<std::size_t>(3 * ((degree + 1) * (degree + 1) - 1))) return degree;
  }
  fail_splats(file, fmt::format("must have 0, 9, 24, 45 or 72 properties f_rest_..., not {}; export it again", rest));
}

bool is_compressed(const PlyHeader& header) {
  const PlyElement* const vertex = header.find("vertex");
  return vertex != nullptr && header.find("chunk") != nullptr && vertex->has("packed_position");
}

bool is_plain(const PlyHeader& header) {
  const PlyElement* const vertex = header.find("vertex");
  return vertex != nullptr && vertex->has("f_dc_0");
}

Splats read_plain(const std::filesystem::path& file, const PlyHeader& header, const WarningHandler& warn) {
  const PlyElement& vertex = *header.find("vertex");
  const std::size_t rest = count_rest(vertex);
  const int file_degree = degree_of_rest(file, rest);
  if (file_degree > kMaxSplatDegree) warn_of_degree(file, file_degree, warn);
  const bool flat = !vertex.has("scale_2");

  enum Column { kX, kDc = 3, kOpacity = 6, kRotation = 7, kScale = 11 };
  std::vector<std::string> names = {"x",     "y",     "z",     "f_dc_0", "f_dc_1",  "f_dc_2", "opacity",
                                    "rot_0", "rot_1", "rot_2", "rot_3",  "scale_0", "scale_1"};
  if (!flat) names.emplace_back("scale_2");
  const std::size_t rest_at = names.size();
  for (std::size_t i = 0; i < rest; ++i) names.push_back(fmt::format("f_rest_{}", i));

  PlyRows rows(file, header, vertex, names);
  SplatList list(file, std::min(file_degree, kMaxSplatDegree), vertex.count, rows.file_bytes());
  read_comments(header, list);
  const std::size_t coefficients = list.coefficients(), rest_per_colour = rest / 3;
  for (std::uint64_t row = 0; row < vertex.count; ++row) {
    const std::vector<double>& values = rows.next();
    const auto value = [&](std::size_t column) { return static_cast<float>(values[column]); };
    Splat splat;
    splat.position = {value(kX), value(kX + 1), value(kX + 2)};
    splat.deviation = {std::exp(value(kScale)), std::exp(value(kScale + 1)), flat ? 0 : std::exp(value(kScale + 2))};
    splat.rotation = {value(kRotation + 1), value(kRotation + 2), value(kRotation + 3), value(kRotation)};
    splat.opacity = sigmoid(value(kOpacity));
    for (std::size_t colour = 0; colour < 3; ++colour) {
      splat.harmonics[colour] = value(kDc + colour);
      // All coefficients of red precede those of green and blue.
      for (std::size_t k = 1; k < coefficients; ++k)
        splat.harmonics[3 * k + colour] = value(rest_at + colour * rest_per_colour + k - 1);
    }
    list.add(splat);
  }
  return list.finish(warn);
}

/// Bits of an integer as a fraction of their largest value.
float fraction(std::uint32_t word, int shift, int bits) {
  const std::uint32_t largest = (1U << bits) - 1;
  return static_cast<float>((word >> shift) & largest) / static_cast<float>(largest);
}

/// Three numbers from 0 to 1, in 11, 10 and 11 bits.
Eigen::Vector3f unpack_vector(std::uint32_t word) {
  return {fraction(word, 21, 11), fraction(word, 11, 10), fraction(word, 0, 11)};
}

/// A unit quaternion w x y z of which the largest component is left out: its index in 2 bits, and the others, from
/// -sqrt(1/2) to sqrt(1/2), in 10 bits each. The result is x y z w.
Eigen::Vector4f unpack_rotation(std::uint32_t word) {
  Eigen::Vector4f wxyz;
  const auto largest = static_cast<Eigen::Index>(word >> 30);
  float rest = 1;
  for (Eigen::Index i = 0, shift = 20; i < 4; ++i) {
    if (i == largest) continue;
    wxyz[i] = (fraction(word, static_cast<int>(shift), 10) - 0.5F) * std::numbers::sqrt2_v<float>;
    rest -= wxyz[i] * wxyz[i];
    shift -= 10;
  }
  wxyz[largest] = std::sqrt(std::max(rest, 0.0F));
  return {wxyz[1], wxyz[2], wxyz[3], wxyz[0]};
}

/// Limits of numbers of the 256 splats of a chunk.
struct Limits {
  Eigen::Vector3f low, high;
  Eigen::Vector3f at(const Eigen::Vector3f& t) const {
    return low.array() * (1 - t.array()) + high.array() * t.array();
  }
};

struct Chunk {
  Limits position, scale, colour{Eigen::Vector3f::Zero(), Eigen::Vector3f::Ones()};
};

std::vector<Chunk> read_chunks(const std::filesystem::path& file, const PlyHeader& header, std::uint64_t needed) {
  const PlyElement& element = *header.find("chunk");
  if (element.count < needed)
    fail_splats(file,
                fmt::format("must have {} rows of the element chunk, not {}; export it again", needed, element.count));
  const bool has_colours = element.has("min_r");
  std::vector<std::string> names;
  for (const char* const kind : {"", "scale_"}) {
    for (const char* const limit : {"min", "max"}) {
      for (const char* const axis : {"x", "y", "z"}) names.push_back(fmt::format("{}_{}{}", limit, kind, axis));
    }
  }
  if (has_colours) names.insert(names.end(), {"min_r", "min_g", "min_b", "max_r", "max_g", "max_b"});

  PlyRows rows(file, header, element, names);
  std::vector<Chunk> chunks(needed);
  for (Chunk& chunk : chunks) {
    const std::vector<double>& values = rows.next();
    const auto limits = [&](std::size_t at) {
      const Eigen::Map<const Eigen::Vector3d> low(&values[at]), high(&values[at + 3]);
      return Limits{low.cast<float>(), high.cast<float>()};
    };
    chunk.position = limits(0), chunk.scale = limits(6);
    if (has_colours) chunk.colour = limits(12);
  }
  return chunks;
}

/// A coefficient in a byte, in steps of 1/32 between -4 and 4.
float unpack_harmonic(double byte) {
  const double t = byte <= 0 ? 0 : byte >= 255 ? 1 : (byte + 0.5) / 256;
  return static_cast<float>((t - 0.5) * 8);
}

Splats read_compressed(const std::filesystem::path& file, const PlyHeader& header, const WarningHandler& warn) {
  const PlyElement& vertex = *header.find("vertex");
  const PlyElement* const harmonics = header.find("sh");
  if (harmonics != nullptr && harmonics->count != vertex.count)
    fail_splats(file, fmt::format("must have as many rows of the element sh as splats, {}, not {}; export it again",
                                  vertex.count, harmonics->count));
  const std::size_t rest = harmonics != nullptr ? count_rest(*harmonics) : 0, rest_per_colour = rest / 3;
  const int file_degree = degree_of_rest(file, rest);
  if (file_degree > kMaxSplatDegree) warn_of_degree(file, file_degree, warn);

  PlyRows rows(file, header, vertex, {"packed_position", "packed_rotation", "packed_scale", "packed_color"});
  SplatList list(file, std::min(file_degree, kMaxSplatDegree), vertex.count, rows.file_bytes());
  read_comments(header, list);
  const std::vector<Chunk> chunks =
      read_chunks(file, header, vertex.count / kSplatsPerChunk + (vertex.count % kSplatsPerChunk > 0 ? 1 : 0));
  std::optional<PlyRows> rest_rows;
  if (rest > 0) {
    std::vector<std::string> names;
    for (std::size_t i = 0; i < rest; ++i) names.push_back(fmt::format("f_rest_{}", i));
    rest_rows.emplace(file, header, *harmonics, names);
  }

  for (std::uint64_t row = 0; row < vertex.count; ++row) {
    const std::vector<double>& values = rows.next();
    const Chunk& chunk = chunks[row / kSplatsPerChunk];
    const auto word = [&](std::size_t column) {
      const double value = values[column];
      return value >= 0 && value <= 4294967295.0 ? static_cast<std::uint32_t>(value) : 0U;
    };
    const std::uint32_t colour_bits = word(3);
    Splat splat;
    splat.position = chunk.position.at(unpack_vector(word(0)));
    splat.rotation = unpack_rotation(word(1));
    splat.deviation = chunk.scale.at(unpack_vector(word(2))).array().exp();
    splat.opacity = fraction(colour_bits, 0, 8);
    const Eigen::Vector3f colour =
        chunk.colour.at({fraction(colour_bits, 24, 8), fraction(colour_bits, 16, 8), fraction(colour_bits, 8, 8)});
    for (std::size_t i = 0; i < 3; ++i) splat.harmonics[i] = harmonic_of_colour(colour[static_cast<Eigen::Index>(i)]);
    if (rest_rows) {
      const std::vector<double>& coefficients = rest_rows->next();
      for (std::size_t k = 1; k < list.coefficients(); ++k) {
        for (std::size_t i = 0; i < 3; ++i)
          splat.harmonics[3 * k + i] = unpack_harmonic(coefficients[i * rest_per_colour + k - 1]);
      }
    }
    list.add(splat);
  }
  return list.finish(warn);
}

}  // namespace

bool is_splat_ply(const std::filesystem::path& file) {
  const PlyHeader header = read_ply_header(file);
  return is_plain(header) || is_compressed(header);
}

Splats read_splat_ply(const std::filesystem::path& file, const WarningHandler& warn) {
  const PlyHeader header = read_ply_header(file);
  if (is_compressed(header)) return read_compressed(file, header, warn);
  if (is_plain(header)) return read_plain(file, header, warn);
  const PlyElement* const faces = header.find("face");
  if (faces != nullptr && faces->count > 0) fail_triangles(file);
  fail_splats(file, "contains no Gaussian splats: the property f_dc_0 of the element vertex is missing");
}

}  // namespace esim::inline scene
