#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "esim/files/input_file.h"

// Private to scene.
namespace esim::inline scene {

enum class PlyEncoding { ascii, little_endian, big_endian };

enum class PlyType : std::uint8_t { int8, uint8, int16, uint16, int32, uint32, float32, float64 };

struct PlyProperty {
  std::string name;
  PlyType type = PlyType::float32;
  bool list = false;
};

struct PlyElement {
  std::string name;
  std::uint64_t count = 0;
  std::vector<PlyProperty> properties{};

  std::optional<std::size_t> find(std::string_view property) const;
  bool has(std::string_view property) const { return find(property).has_value(); }
};

/// The header of a PLY file, as Greg Turk's "The PLY Polygon File Format" (1994) describes it.
struct PlyHeader {
  PlyEncoding encoding = PlyEncoding::ascii;
  std::vector<PlyElement> elements;
  std::vector<std::string> comments;
  std::uint64_t bytes = 0;  ///< of the header

  /// An element, or null.
  const PlyElement* find(std::string_view element) const;
};

/// Throws UserError if it is not a valid header.
PlyHeader read_ply_header(const std::filesystem::path& file);

/// Reads some properties of an element, row by row, in blocks.
class PlyRows {
 public:
  /// Throws UserError if properties are missing, or if the file is too short for all rows.
  PlyRows(const std::filesystem::path& file, const PlyHeader& header, const PlyElement& element,
          const std::vector<std::string>& properties);
  PlyRows(const PlyRows&) = delete;
  PlyRows& operator=(const PlyRows&) = delete;

  /// The values of the next row, in the order of `properties`. There are `element.count` rows.
  const std::vector<double>& next();

  std::uint64_t file_bytes() const { return file_.size(); }

  /// After the last row: where the next element begins.
  std::uint64_t offset() const { return file_.offset(); }

 private:
  struct Column {
    std::size_t offset = 0;  // in bytes from the start of the row, or in words of ASCII
    PlyType type = PlyType::float32;
  };

  void next_block();
  void next_line();

  InputFile file_;
  PlyEncoding encoding_;
  std::string name_;
  std::uint64_t count_, row_ = 0;
  std::size_t row_bytes_ = 0, words_ = 0;  // words: number of properties
  std::vector<Column> columns_;
  std::vector<double> values_, line_;
  std::span<const std::byte> block_;  // of whole rows
  std::size_t at_ = 0;                // of the next row in the block
};

}  // namespace esim::inline scene
