#include "esim/formats/text/csv.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <iterator>
#include <utility>

#include "esim/files/number_text.h"

namespace esim::inline formats {

CsvFile::CsvFile(std::filesystem::path path, std::string_view header) : file_(std::move(path)) {
  file_.append(header);
  file_.append("\n");
}

void CsvFile::begin_line(TimeNs t) { fmt::format_to(std::back_inserter(file_.buffer()), "{}", t); }

void CsvFile::append(const Eigen::Vector3d& value) {
  fmt::format_to(std::back_inserter(file_.buffer()), ",{},{},{}", value.x(), value.y(), value.z());
}

void CsvFile::append(const Eigen::Vector4d& value) {
  append(Eigen::Vector3d(value.head<3>()));
  fmt::format_to(std::back_inserter(file_.buffer()), ",{}", value.w());
}

void CsvFile::end_line() {
  file_.buffer().push_back('\n');
  file_.flush_if_full();
}

bool CsvReader::next() {
  constexpr std::size_t kMaxLineBytes = 1 << 12;
  while (file_.offset() < file_.size()) {
    line_start_ = file_.offset();
    std::string_view line = file_.read_line(kMaxLineBytes, "a line");
    if (unfinished_ && line_start_ + line.size() == file_.size()) return false;
    if (line.empty() || (line[0] != '-' && std::isdigit(static_cast<unsigned char>(line[0])) == 0)) continue;
    fields_.clear();
    while (!line.empty()) {
      std::string_view field = line.substr(0, line.find(','));
      line.remove_prefix(std::min(field.size() + 1, line.size()));
      fields_.push_back(take_word(field));
    }
    if (fields_.size() < columns_) fail(fmt::format("the line has {} numbers, but needs {}", fields_.size(), columns_));
    const TimeNs t = integer(time_column_);
    if (const auto problem = problem_of_time(t_, t); !problem.empty()) fail(problem);
    t_ = t;
    return true;
  }
  return false;
}

std::int64_t CsvReader::integer(std::size_t column) const {
  std::int64_t value = 0;
  if (!parse_number(fields_[column], value)) fail(fmt::format("\"{}\" is not a whole number", fields_[column]));
  return value;
}

double CsvReader::value(std::size_t column) const {
  double value = 0;
  if (!parse_number(fields_[column], value) || !std::isfinite(value))
    fail(fmt::format("\"{}\" is not a finite number", fields_[column]));
  return value;
}

Eigen::Vector3d CsvReader::vector(std::size_t first_column) const {
  return {value(first_column), value(first_column + 1), value(first_column + 2)};
}

}  // namespace esim::inline formats
