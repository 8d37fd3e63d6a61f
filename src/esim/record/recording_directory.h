#pragma once

#include <filesystem>
#include <string_view>
#include <vector>

namespace esim {

/// The life of a recording on disk. Everything is written in OUT.incomplete/, which becomes OUT only when it is whole:
///
///   constructor    OUT.incomplete/ with a report.json that says "running"
///   finish()       the final report, then OUT.incomplete -> OUT, in one step also where an older OUT is replaced
///   destructor     without finish(): OUT.incomplete is removed, an error leaves nothing behind
///   killed         OUT.incomplete stays
class RecordingDirectory {
 public:
  /// Throws UserError if OUT exists or OUT.incomplete is left from a killed run, unless `force`; with it, still if what
  /// would be replaced does not look like a recording, or is being written by a running process.
  RecordingDirectory(const std::filesystem::path& out, bool force);
  ~RecordingDirectory();
  RecordingDirectory(const RecordingDirectory&) = delete;
  RecordingDirectory& operator=(const RecordingDirectory&) = delete;

  /// Where to write: OUT.incomplete.
  const std::filesystem::path& path() const { return working_; }

  /// Where the recording will be: OUT.
  const std::filesystem::path& final_path() const { return out_; }

  /// Writes report.json, makes the directory durable and puts it in its place. If only the last step fails, the
  /// recording is kept in OUT.incomplete and the exception says so.
  void finish(std::string_view report_json);

 private:
  void create_parents();
  void create_working_directory(bool force);
  void discard() noexcept;

  std::filesystem::path out_, working_;
  std::vector<std::filesystem::path> created_parents_;
  bool replace_ = false;  // there is an OUT that may be replaced
  bool owned_ = false;    // the working directory was made here
  bool keep_ = false;
  int lock_ = -1;  // descriptor of the working directory, locked while this process writes there
};

/// OUT.incomplete.
std::filesystem::path incomplete_path(const std::filesystem::path& out);

/// Whether a process is writing in this directory now.
bool is_being_written(const std::filesystem::path& working_directory);

/// Whether the report.json in a folder is that of a conversion: such a one stands beside files of any format that is a
/// folder, and does not make a recording of them.
bool has_conversion_report(const std::filesystem::path& folder);

}  // namespace esim
