#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

namespace esim::inline files {

/// The description of results that several runs or processes put into one folder: a JSON file, which is written first.
struct FolderPlan {
  std::string kind{};  ///< of the results, for messages: "dataset"
  std::string file{};  ///< its name in the folder: "dataset.json"
  std::string json{};  ///< an object; its member "esim" is the version of esim
};

/// Begins the results in a new or an empty folder, or checks that the folder contains results of the same plan. Throws
/// UserError if it contains anything else, or results of another plan or version, with the difference.
void begin_or_continue(const std::filesystem::path& folder, const FolderPlan& plan);

/// The exclusive right to make a part of the results during the lifetime of this object. Also ends with the process.
class FolderLock {
 public:
  /// Of the part with this number, below 2^40. If another process has it, waits if `wait`.
  FolderLock(const std::filesystem::path& folder, std::uint64_t part, bool wait = false);
  ~FolderLock();
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;

  /// False if another process has the lock.
  bool owned() const { return descriptor_ >= 0; }

 private:
  int descriptor_ = -1;
};

/// The content of a small file; empty optional if it does not exist.
std::optional<std::string> read_text(const std::filesystem::path& file);

}  // namespace esim::inline files
