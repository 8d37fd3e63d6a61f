#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "esim/dataset/files/contents.h"

namespace esim::inline dataset {

enum class ShardFormat { hdf5, webdataset };

/// The description of a dataset: number of sequences, contents, and files. The same for all processes that work on it.
struct DatasetPlan {
  std::uint32_t count = 0;       ///< sequences
  std::uint32_t shard_size = 0;  ///< sequences per file; the last file may have fewer
  ShardFormat format = ShardFormat::hdf5;
  DatasetContents contents{};
  std::string maker{};  ///< SequenceMaker::options()

  std::uint32_t shards() const { return (count + shard_size - 1) / shard_size; }
  std::uint32_t first_of(std::uint32_t shard) const { return shard * shard_size; }
  std::uint32_t size_of(std::uint32_t shard) const { return std::min(shard_size, count - first_of(shard)); }
};

/// The default number of sequences per file: 100, or fewer so that a small dataset has sixteen files.
std::uint32_t usual_shard_size(std::uint32_t count);

/// The record of one file, written when the file is complete.
struct ShardRecord {
  std::uint32_t shard = 0, first = 0, count = 0;
  std::string file{};
  std::uint64_t bytes = 0;
  std::uint32_t crc32 = 0;
  std::uint64_t events = 0;
  std::vector<std::uint64_t> magnitudes{};  ///< pixels by magnitude of optical flow; the last is beyond the bins
  std::map<std::string, std::string> passed_over{};  ///< unusable images and the reasons
};

/// A dataset on disk. Several processes on several machines may write it at the same time:
///
///   dataset.json              the plan and the version of esim; written first
///   shard-000012.h5 or .tar   sequences
///   shard-000012.json         its record; written when the file is complete
///   .lock                     a FolderLock of part k is held while a process writes shard k
///   manifest.json             all records; written when the dataset is complete
///
/// Each file appears under its name atomically, when it is complete and on disk.
class DatasetFolder {
 public:
  /// Begins or continues a dataset. Throws UserError if the folder contains anything else, or a dataset of another plan
  /// or version, with the difference.
  DatasetFolder(std::filesystem::path folder, const DatasetPlan& plan, const std::string& version);

  /// Opens an existing dataset. Throws UserError if the folder is not a dataset.
  explicit DatasetFolder(std::filesystem::path folder);

  const std::filesystem::path& path() const { return folder_; }
  const DatasetPlan& plan() const { return plan_; }
  const std::string& version() const { return version_; }

  std::string shard_name(std::uint32_t shard) const;  ///< of its file
  std::filesystem::path record_path(std::uint32_t shard) const;

  /// Empty if the shard must still be made: its record or its file is missing, or the file has another size.
  std::optional<ShardRecord> record(std::uint32_t shard) const;

  void write_record(const ShardRecord& record) const;

  /// A temporary name for a file of the shard, unique among processes and threads.
  std::filesystem::path working_path(std::uint32_t shard) const;

  /// Removes files that killed processes have left of a shard. Call only with its lock held.
  void remove_leftovers(std::uint32_t shard) const;

 private:
  std::filesystem::path folder_;
  DatasetPlan plan_;
  std::string version_;
};

/// The record as it is written in a manifest.
std::string to_json(const ShardRecord& record);

}  // namespace esim::inline dataset
