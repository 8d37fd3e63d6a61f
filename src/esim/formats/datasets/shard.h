#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

/// Files with many labelled sequences: the parts of a dataset.
namespace esim::inline formats {

enum class NumberType { int8, uint8, uint16, uint32, int64, float32 };

/// An array of a sequence, borrowed, in row-major order.
struct ShardArray {
  std::string name{};  ///< "flow", or "events/t"
  NumberType type = NumberType::float32;
  std::vector<std::uint64_t> shape{};
  const void* numbers = nullptr;
  bool ragged = false;  ///< one-dimensional, of a length that differs between sequences
  std::string about{};  ///< unit and meaning, as text
};

template <typename T>
inline constexpr NumberType kNumberType = NumberType::float32;
template <>
inline constexpr NumberType kNumberType<std::int8_t> = NumberType::int8;
template <>
inline constexpr NumberType kNumberType<std::uint8_t> = NumberType::uint8;
template <>
inline constexpr NumberType kNumberType<std::uint16_t> = NumberType::uint16;
template <>
inline constexpr NumberType kNumberType<std::uint32_t> = NumberType::uint32;
template <>
inline constexpr NumberType kNumberType<std::int64_t> = NumberType::int64;

struct ShardSequence {
  std::uint32_t index = 0;
  std::vector<ShardArray> arrays{};  ///< the same names, order and shapes in all sequences of a file
  std::string info{};                ///< JSON
};

/// Writes one file. Its bytes do not depend on when or where it is written. Throws OutputError that names the file.
class ShardWriter {
 public:
  virtual ~ShardWriter() = default;
  virtual void add(const ShardSequence& sequence) = 0;

  /// Makes everything durable.
  virtual void finish() = 0;
};

/// HDF5: `index` [S] and `info` (JSON, one line per sequence), and for each array
///   NAME         [S, ...]   one entry per sequence, which is one chunk with Blosc compression
/// and for ragged ones
///   NAME         [N]        all sequences concatenated
///   START        [S + 1]    sequence k is [START[k], START[k + 1]); `events/start` for `events/t`
std::unique_ptr<ShardWriter> make_hdf5_shard(const std::filesystem::path& file);

/// An uncompressed tar file for WebDataset and other sequential readers: for each sequence, `00000042.NAME.npy` of each
/// array, with dots for slashes in its name, and `00000042.json`.
std::unique_ptr<ShardWriter> make_tar_shard(const std::filesystem::path& file);

}  // namespace esim::inline formats
