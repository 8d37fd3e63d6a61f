#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

/// Files that hold many labelled sequences: the parts of a dataset.
namespace esim {

enum class NumberType { int8, uint8, uint16, uint32, int64, float32 };

/// An array that belongs to a sequence, borrowed, rows one after the other.
struct ShardArray {
  std::string name{};  ///< "flow", or "events/t"
  NumberType type = NumberType::float32;
  std::vector<std::uint64_t> shape{};
  const void* numbers = nullptr;
  bool ragged = false;  ///< of one dimension, in which sequences differ
  std::string about{};  ///< unit and meaning, for people
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
  std::vector<ShardArray> arrays{};  ///< the same ones, in the same order and with the same shapes, in all of a file
  std::string info{};                ///< JSON
};

/// Writes one file. No byte of it depends on when or where it is written. Throws OutputError naming the file.
class ShardWriter {
 public:
  virtual ~ShardWriter() = default;
  virtual void add(const ShardSequence& sequence) = 0;

  /// Makes everything durable.
  virtual void finish() = 0;
};

/// HDF5: `index` [S] and `info` (JSON, a line for each sequence), and for each array
///   NAME         [S, ...]   one entry for each sequence; with Blosc's compression, one chunk
/// and for ragged ones
///   NAME         [N]        of all sequences one after the other
///   START        [S + 1]    those of sequence k are from START[k] to START[k + 1]; `events/start` for `events/t`
std::unique_ptr<ShardWriter> make_hdf5_shard(const std::filesystem::path& file);

/// A tar file for WebDataset and other readers of samples in sequence, without compression: for each sequence
/// `00000042.NAME.npy` of each array, a slash in its name written as a dot, and `00000042.json`.
std::unique_ptr<ShardWriter> make_tar_shard(const std::filesystem::path& file);

}  // namespace esim
