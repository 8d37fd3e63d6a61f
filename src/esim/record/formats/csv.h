#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <string_view>

#include "esim/core/time.h"
#include "esim/record/output_file.h"

namespace esim {

/// A file of numbers in the style of the EuRoC data set: a header `#timestamp [ns],name [unit],...`, then a line for
/// each instant, nanoseconds and the shortest decimals that read back as the same doubles, separated by commas.
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

}  // namespace esim
