#pragma once

#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <set>
#include <string>
#include <thread>
#include <tuple>
#include <vector>

#include "esim/core/inputs/used_files.h"

namespace esim::inline core {

/// An input file and the SHA-256 sum of its content.
struct HashedFile {
  UsedFile file;          ///< with `sha256`, unless there is a problem
  std::string problem{};  ///< why there is no sum, as the end of a sentence: "FILE was changed while ..."
};

/// Computes the sums of files on a thread of its own, from the moment at which they are added.
class FileHashes {
 public:
  FileHashes();
  ~FileHashes();
  FileHashes(const FileHashes&) = delete;
  FileHashes& operator=(const FileHashes&) = delete;

  /// Adds a file; again only if it has changed.
  void add(const UsedFile& file);

  /// All files in the order in which they were added. Waits for the sums if `wait`; otherwise, those that are not
  /// complete yet are missing. Nothing can be added afterwards.
  std::vector<HashedFile> finish(bool wait);

 private:
  void work();
  bool stops();
  HashedFile hashed(const UsedFile& file);

  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<HashedFile> files_;
  std::set<std::tuple<std::string, std::uint64_t, std::int64_t>> known_;  // their paths and states
  std::size_t done_ = 0;                                                  // of files_, from the first one
  bool ended_ = false;                                                    // no more files come
  bool stopped_ = false;  // the sums that are still missing are not needed
  std::thread thread_;
};

}  // namespace esim::inline core
