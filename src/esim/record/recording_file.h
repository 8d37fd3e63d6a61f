#pragma once

#include <filesystem>
#include <string_view>
#include <vector>

namespace esim {

/// The life of a recording that is one file. It is written as OUT.incomplete, which becomes OUT only when it is whole;
/// without finish() and keep() it is removed, with the parts, OUT.incomplete.*, that archives are made of. A killed
/// process leaves them.
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

  /// From now on the destructor leaves what was written where it is.
  void keep(std::string_view = {}) { kept_ = true; }

 private:
  std::vector<std::filesystem::path> parts() const;

  std::filesystem::path out_, working_;
  bool kept_ = false;
};

}  // namespace esim
