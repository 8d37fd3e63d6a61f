#pragma once

#include <filesystem>
#include <string_view>
#include <vector>

namespace esim::inline recording {

/// The life of a recording that is one file. It is written as OUT.incomplete, which becomes OUT when it is complete.
/// Without finish() and keep(), it is removed together with OUT.incomplete.*, the parts of archives. A killed process
/// leaves these files.
class RecordingFile {
 public:
  /// Throws UserError if OUT or OUT.incomplete exists, unless `force`, or if OUT is a folder; OutputError if its parent
  /// folder is missing.
  RecordingFile(std::filesystem::path out, bool force);
  ~RecordingFile();
  RecordingFile(const RecordingFile&) = delete;
  RecordingFile& operator=(const RecordingFile&) = delete;

  /// The file to write: OUT.incomplete.
  const std::filesystem::path& path() const { return working_; }

  /// Renames the written file to OUT.
  void finish();

  /// From now on, the destructor leaves the written file in place.
  void keep(std::string_view = {}) { kept_ = true; }

 private:
  std::vector<std::filesystem::path> parts() const;

  std::filesystem::path out_, working_;
  bool kept_ = false;
};

}  // namespace esim::inline recording
