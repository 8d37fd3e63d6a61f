#pragma once

#include <filesystem>
#include <optional>
#include <string_view>
#include <vector>

namespace esim {

/// The life of a recording on disk. Everything is written in OUT.incomplete/, which becomes OUT only when it is whole:
///
///   constructor    OUT.incomplete/ with a report.json that says "running"
///   finish()       the final report, then OUT.incomplete -> OUT, in one step also where an older OUT is replaced
///   destructor     without finish() and keep(): OUT.incomplete is removed, an error leaves nothing behind
///   keep()         OUT.incomplete stays, whatever happens: it holds records
///   killed         OUT.incomplete stays
class RecordingDirectory {
 public:
  /// Throws UserError if OUT exists or OUT.incomplete is left from a killed run, unless `force`; with it, still if what
  /// would be replaced does not look like a recording, or is being written by a running process. Throws OutputError
  /// where the folders cannot be made.
  RecordingDirectory(const std::filesystem::path& out, bool force);
  ~RecordingDirectory();
  RecordingDirectory(const RecordingDirectory&) = delete;
  RecordingDirectory& operator=(const RecordingDirectory&) = delete;

  /// Where to write: OUT.incomplete.
  const std::filesystem::path& path() const { return working_; }

  /// Where the recording will be: OUT.
  const std::filesystem::path& final_path() const { return out_; }

  /// Writes report.json, makes the directory durable and puts it in its place. The recording is kept in OUT.incomplete
  /// if that fails.
  void finish(std::string_view report_json);

  /// From now on the destructor leaves OUT.incomplete where it is. If there is a `reason`, report.json says it, and
  /// that the recording is interrupted; on a full disk, report.json stays as it was.
  void keep(std::string_view reason = {}) noexcept;

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

/// Throws UserError where there is nothing at a path, naming OUT.incomplete if that is there.
void require_existing(const std::filesystem::path& path);

/// Whether a process is writing in this directory now.
bool is_being_written(const std::filesystem::path& working_directory);

/// The file of events in a camera's folder: events.h5, or else events.txt.
std::optional<std::filesystem::path> events_file_in(const std::filesystem::path& folder);

/// Whether a file is there and has its first bytes. A simulation creates its files before it writes to them, and writes
/// the signature of an HDF5 file after what it refers to: where it was killed before that, there is nothing to read.
bool has_begun(const std::filesystem::path& file);

/// Whether the report.json in a folder is that of a conversion: such a one stands beside files of any format that is a
/// folder, and does not make a recording of them.
bool has_conversion_report(const std::filesystem::path& folder);

}  // namespace esim
