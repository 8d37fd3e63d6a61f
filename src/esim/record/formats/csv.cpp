#include "esim/record/formats/csv.h"

#include <fmt/format.h>

#include <iterator>
#include <utility>

namespace esim {

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

}  // namespace esim
