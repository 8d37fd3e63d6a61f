#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string_view>
#include <vector>

#include "esim/core/time.h"
#include "esim/files/input_file.h"
#include "esim/files/output_file.h"

namespace esim::inline formats {

/// A CSV file in the style of the EuRoC dataset: a header `#timestamp [ns],name [unit],...`, then one line for each
/// time: nanoseconds, then the shortest decimals that give the same doubles when read, separated by commas.
class CsvFile {
 public:
  CsvFile(std::filesystem::path path, std::string_view header);

  void begin_line(TimeNs t);
  void append(const Eigen::Vector3d& value);
  void append(const Eigen::Vector4d& value);
  void end_line();
  void close() { file_.close(); }

 private:
  OutputFile file_;
};

/// Reads such files, in order of time. Lines that do not start with a digit or a minus sign are headers and are
/// skipped. Failures are UserErrors with the file and the byte at which the line starts.
class CsvReader {
 public:
  /// `columns` is the minimum number of columns, including the time. In an `unfinished` file, whose writer was killed
  /// or is still writing, a last line without a line end is ignored.
  CsvReader(const std::filesystem::path& path, std::size_t columns, std::size_t time_column = 0,
            bool unfinished = false)
      : file_(path), columns_(columns), time_column_(time_column), unfinished_(unfinished) {}

  /// Goes to the next line; returns false at the end.
  bool next();

  TimeNs t() const { return *t_; }
  std::size_t columns() const { return fields_.size(); }  ///< of this line
  std::int64_t integer(std::size_t column) const;
  double value(std::size_t column) const;  ///< finite
  Eigen::Vector3d vector(std::size_t first_column) const;

  [[noreturn]] void fail(std::string_view reason) const { file_.fail(line_start_, reason); }

 private:
  InputFile file_;
  std::size_t columns_, time_column_;
  bool unfinished_;
  std::uint64_t line_start_ = 0;
  std::optional<TimeNs> t_;
  std::vector<std::string_view> fields_;  // of the current line, borrowed from the file
};

}  // namespace esim::inline formats
