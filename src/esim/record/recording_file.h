#pragma once

#include <filesystem>

namespace esim {

/// The life of a recording that is one file. It is written as OUT.incomplete, which becomes OUT only when it is whole;
/// without finish() it is removed. A killed process leaves OUT.incomplete.
class RecordingFile {
 public:
  /// Throws UserError if OUT or OUT.incomplete exists, unless `force`, or if OUT is a folder; OutputError if the folder
  /// that it is to be in is missing.
  RecordingFile(std::filesystem::path out, bool force);
  ~RecordingFile();
  RecordingFile(const RecordingFile&) = delete;
  RecordingFile& operator=(const RecordingFile&) = delete;

  /// Where to write: OUT.incomplete.
  const std::filesystem::path& path() const { return working_; }

  /// Puts what was written in its place.
  void finish();

 private:
  std::filesystem::path out_, working_;
  bool finished_ = false;
};

}  // namespace esim
