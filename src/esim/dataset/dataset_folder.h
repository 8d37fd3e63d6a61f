#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "esim/dataset/contents.h"

namespace esim {

enum class ShardFormat { hdf5, webdataset };

/// What a dataset is: how many sequences of what, in which files. The same for all who work on it.
struct DatasetPlan {
  std::uint32_t count = 0;       ///< sequences
  std::uint32_t shard_size = 0;  ///< sequences in a file, fewer in the last
  ShardFormat format = ShardFormat::hdf5;
  DatasetContents contents{};
  std::string maker{};  ///< SequenceMaker::options()

  std::uint32_t shards() const { return (count + shard_size - 1) / shard_size; }
  std::uint32_t first_of(std::uint32_t shard) const { return shard * shard_size; }
  std::uint32_t size_of(std::uint32_t shard) const { return std::min(shard_size, count - first_of(shard)); }
};

/// How many sequences are in a file where nobody says: 100, of few sequences so that there are sixteen files.
std::uint32_t usual_shard_size(std::uint32_t count);

/// The account of one file, written when it is whole.
struct ShardRecord {
  std::uint32_t shard = 0, first = 0, count = 0;
  std::string file{};
  std::uint64_t bytes = 0;
  std::uint32_t crc32 = 0;
  std::uint64_t events = 0;
  std::vector<std::uint64_t> magnitudes{};           ///< pixels by magnitude of their displacement, the last beyond
  std::map<std::string, std::string> passed_over{};  ///< images that cannot be used, and why
};

/// A dataset on disk, which several processes on several machines may write at the same time:
///
///   dataset.json              the plan, and the version of esim; there from the beginning
///   shard-000012.h5 or .tar   sequences
///   shard-000012.json         its record; there when the file is whole
///   .lock                     byte k is locked while somebody writes shard k
///   manifest.json             all records; there when the dataset is whole
///
/// All files appear under their names at once, when they are whole and on the disk.
class DatasetFolder {
 public:
  /// Begins a dataset, or goes on with one. Throws UserError where the folder holds something else, or a dataset of
  /// another plan or version, naming what differs.
  DatasetFolder(std::filesystem::path folder, const DatasetPlan& plan, const std::string& version);

  /// Opens one that is there. Throws UserError where there is none.
  explicit DatasetFolder(std::filesystem::path folder);

  const std::filesystem::path& path() const { return folder_; }
  const DatasetPlan& plan() const { return plan_; }
  const std::string& version() const { return version_; }

  std::string shard_name(std::uint32_t shard) const;  ///< of its file
  std::filesystem::path record_path(std::uint32_t shard) const;

  /// Nothing where the shard is still to be made: its record or its file is missing, or the file has another size.
  std::optional<ShardRecord> record(std::uint32_t shard) const;

  void write_record(const ShardRecord& record) const;

  /// A name for a file of the shard's, until it is whole, that no other process and thread has.
  std::filesystem::path working_path(std::uint32_t shard) const;

  /// Removes what killed processes have left of a shard. To be called by who has its lock.
  void remove_leftovers(std::uint32_t shard) const;

 private:
  std::filesystem::path folder_;
  DatasetPlan plan_;
  std::string version_;
};

/// The right to write a shard, for as long as it lives. Ends with the process, too.
class ShardLock {
 public:
  ShardLock(const DatasetFolder& folder, std::uint32_t shard);
  ~ShardLock();
  ShardLock(const ShardLock&) = delete;
  ShardLock& operator=(const ShardLock&) = delete;

  /// False where somebody else has it.
  bool owned() const { return descriptor_ >= 0; }

 private:
  int descriptor_ = -1;
};

/// As it stands in a manifest.
std::string to_json(const ShardRecord& record);

}  // namespace esim
