#pragma once

#include <filesystem>
#include <optional>
#include <string_view>
#include <vector>

namespace esim::inline recording {

/// The life of a recording on disk. Everything is written in OUT.incomplete/, which becomes OUT when it is complete:
///
///   constructor    OUT.incomplete/ with a report.json that says "running"
///   finish()       the final report, then OUT.incomplete -> OUT, in one step even if an older OUT is replaced
///   destructor     without finish() and keep(): removes OUT.incomplete, so an error leaves nothing behind
///   keep()         OUT.incomplete stays, whatever happens: it holds records
///   killed         OUT.incomplete stays; resume() takes it over
class RecordingDirectory {
 public:
  /// Throws UserError if OUT exists or OUT.incomplete is left from a killed run, unless `force`; even with `force`, if
  /// the existing folder does not look like a recording or a running process is writing it. Throws OutputError if the
  /// folders cannot be created.
  RecordingDirectory(const std::filesystem::path& out, bool force);

  /// The folder that resume() takes over: OUT.incomplete of a run that was killed, or else OUT. Throws UserError if
  /// there is neither, or if a running process is writing it.
  static std::filesystem::path resumable(const std::filesystem::path& out);

  /// Takes over that folder with its files; OUT becomes OUT.incomplete again.
  static RecordingDirectory resume(const std::filesystem::path& out);

  ~RecordingDirectory();
  RecordingDirectory(const RecordingDirectory&) = delete;
  RecordingDirectory& operator=(const RecordingDirectory&) = delete;

  /// The folder to write to: OUT.incomplete.
  const std::filesystem::path& path() const { return working_; }

  /// The final folder of the recording: OUT.
  const std::filesystem::path& final_path() const { return out_; }

  /// Writes report.json, makes the directory durable and renames it to OUT. If that fails, the recording stays in
  /// OUT.incomplete.
  void finish(std::string_view report_json);

  /// From now on, the destructor leaves OUT.incomplete in place. With a `reason`, report.json states it and that the
  /// recording was interrupted; on a full disk, report.json stays unchanged.
  void keep(std::string_view reason = {}) noexcept;

 private:
  RecordingDirectory(std::filesystem::path out, std::filesystem::path working);
  void create_parents();
  void create_working_directory(bool force);
  void discard() noexcept;

  std::filesystem::path out_, working_;
  std::vector<std::filesystem::path> created_parents_;
  bool replace_ = false;  // OUT exists and may be replaced
  bool owned_ = false;    // this object created the working directory
  bool keep_ = false;
  int lock_ = -1;  // descriptor of the working directory, locked while this process writes to it
};

/// OUT.incomplete.
std::filesystem::path incomplete_path(const std::filesystem::path& out);

/// Throws UserError if a path does not exist; names OUT.incomplete if that exists.
void require_existing(const std::filesystem::path& path);

/// Whether a process is currently writing to this directory.
bool is_being_written(const std::filesystem::path& working_directory);

/// The events file in a camera's folder: events.h5, or else events.txt.
std::optional<std::filesystem::path> events_file_in(const std::filesystem::path& folder);

/// Whether a file exists and has its first bytes. A simulation creates its files before it writes to them, and writes
/// the signature of an HDF5 file after the data that it refers to: if it is killed before that, nothing can be read.
bool has_begun(const std::filesystem::path& file);

/// Whether the report.json in a folder is that of a conversion. Conversions write one into folders of any format, so it
/// does not make the folder a recording.
bool has_conversion_report(const std::filesystem::path& folder);

}  // namespace esim::inline recording
