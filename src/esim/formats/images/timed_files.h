#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "esim/files/input_file.h"
#include "esim/files/output_file.h"
#include "esim/recording/record.h"

namespace esim::inline formats {

inline constexpr const char* kTimedFilesList = "timestamps.txt";

/// Names the files of a folder, 000000.png and so on, and lists them in its timestamps.txt: lines `index t_s file`, or
/// `index t_s until_s file` for data about a span of time; seconds with nine decimals.
class TimedFilesWriter {
 public:
  /// Creates the folder. `extension`: ".png".
  TimedFilesWriter(const std::filesystem::path& folder, std::string extension, bool spans = false);

  /// The path of the next file; call before its add().
  std::filesystem::path next_path() const { return folder_ / next_name(); }

  /// Lists the file that was written.
  void add(TimeNs t) { add_line(t, std::nullopt); }
  void add(TimeSpan span) { add_line(span.start, span.end); }
  void close() { list_.close(); }

 private:
  std::string next_name() const;
  void add_line(TimeNs t, std::optional<TimeNs> until);

  std::filesystem::path folder_;
  std::string extension_;
  std::int64_t count_ = 0;
  OutputFile list_;
};

/// Reads such a list line by line, in order of time. Failures are UserErrors with the list and the byte at which the
/// line starts.
class TimedFilesReader {
 public:
  /// `unfinished`: as in CsvReader.
  explicit TimedFilesReader(const std::filesystem::path& folder, bool spans = false, bool unfinished = false)
      : folder_(folder), spans_(spans), unfinished_(unfinished), list_(folder / kTimedFilesList) {}

  /// Goes to the next file; returns false at the end.
  bool next();

  TimeSpan span() const { return span_; }  ///< without spans, start and end are its time
  const std::filesystem::path& file() const { return file_; }

 private:
  void parse(std::string_view line, std::uint64_t offset);

  std::filesystem::path folder_;
  bool spans_, unfinished_;
  InputFile list_;
  std::optional<TimeNs> last_;
  TimeSpan span_{};
  std::filesystem::path file_;
};

/// Whether there is such a list, with files of this extension.
bool lists_files(const std::filesystem::path& folder, std::string_view extension);

}  // namespace esim::inline formats
