#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "esim/core/inputs/file_hashes.h"

namespace esim::inline compose {

/// How a recording can be made again.
struct Repetition {
  std::string command{};   ///< for a shell, in the working folder; empty if no command repeats the recording
  std::string obstacle{};  ///< why not
};

/// How a recording was made, for its report.
struct Provenance {
  Repetition repetition{};
  std::filesystem::path working_folder{};
  std::vector<HashedFile> inputs{};
};

/// The current folder of this process; empty if it does not exist.
std::filesystem::path current_folder();

/// Collects how a recording was made, and hashes its input files meanwhile.
class ProvenanceRecorder {
 public:
  explicit ProvenanceRecorder(Repetition repetition, std::filesystem::path working_folder = current_folder())
      : repetition_(std::move(repetition)), working_folder_(std::move(working_folder)) {}

  /// Adds files that were opened before.
  void add(const std::vector<UsedFile>& files);

  /// Adds a file that is opened now.
  void add(const UsedFile& file) { hashes_.add(file); }

  /// What is known at the end. Waits for the hashes of all files if `wait`.
  Provenance finish(bool wait);

 private:
  Repetition repetition_;
  std::filesystem::path working_folder_;
  FileHashes hashes_;
};

/// A text quoted as one word of a shell.
std::string shell_quoted(const std::string& word);

/// Words as a command of a shell; those that a shell takes as they are are not quoted.
std::string shell_command(const std::vector<std::string>& words);

/// The command line of this process.
std::vector<std::string> own_command_line();

/// The commit from which esim was built, with "-dirty" if files had been changed; "unknown" if it was built neither
/// from a clone nor from an archive that names its commit.
std::string_view source_commit();

}  // namespace esim::inline compose
