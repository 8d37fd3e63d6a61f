#include "esim/formats/images/timed_files.h"

#include <fmt/format.h>

#include <iterator>
#include <utility>

#include "esim/files/number_text.h"

namespace esim::inline formats {
namespace {

const std::filesystem::path& created(const std::filesystem::path& folder) {
  create_folder(folder);
  return folder;
}

}  // namespace

TimedFilesWriter::TimedFilesWriter(const std::filesystem::path& folder, std::string extension, bool spans)
    : folder_(created(folder)), extension_(std::move(extension)), list_(folder / kTimedFilesList) {
  list_.append(spans ? "# index t_s until_s file\n" : "# index t_s file\n");
}

std::string TimedFilesWriter::next_name() const { return fmt::format("{:06}{}", count_, extension_); }

void TimedFilesWriter::add_line(TimeNs t, std::optional<TimeNs> until) {
  std::string& line = list_.buffer();
  fmt::format_to(std::back_inserter(line), "{} ", count_);
  append_seconds(line, t);
  line += " ";
  if (until) {
    append_seconds(line, *until);
    line += " ";
  }
  line += next_name() + "\n";
  list_.flush();
  ++count_;
}

bool TimedFilesReader::next() {
  constexpr std::size_t kMaxLineBytes = 1 << 10;
  while (list_.offset() < list_.size()) {
    const std::uint64_t offset = list_.offset();
    const std::string_view line = list_.read_line(kMaxLineBytes, "a line");
    if (unfinished_ && offset + line.size() == list_.size()) return false;
    if (line.empty() || line.starts_with('#')) continue;
    parse(line, offset);
    return true;
  }
  return false;
}

void TimedFilesReader::parse(std::string_view line, std::uint64_t offset) {
  take_word(line);
  const std::string_view start = take_word(line), end = spans_ ? take_word(line) : start, name = take_word(line);
  if (name.empty() || !parse_seconds(start, span_.start) || !parse_seconds(end, span_.end))
    list_.fail(offset, spans_ ? "expected: index t_s until_s file" : "expected: index t_s file");
  for (const auto& [last, t] : {std::pair{last_, span_.start}, {std::optional(span_.start), span_.end}}) {
    if (const auto problem = problem_of_time(last, t); !problem.empty()) list_.fail(offset, problem);
  }
  last_ = span_.start;
  if (name.find('/') != std::string_view::npos || name == "..")
    list_.fail(offset, fmt::format("\"{}\" is not the name of a file in this folder", name));
  file_ = folder_ / name;
}

bool lists_files(const std::filesystem::path& folder, std::string_view extension) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(folder / kTimedFilesList, error)) return false;
  std::string head = read_head(folder / kTimedFilesList, 4096);
  // Each complete line that is not a comment names a file.
  bool any = false;
  std::string_view rest = head;
  while (!rest.empty()) {
    const std::size_t end = rest.find('\n');
    if (end == std::string_view::npos) break;
    const std::string_view line = rest.substr(0, end);
    rest.remove_prefix(end + 1);
    if (line.empty() || line.starts_with('#')) continue;
    if (!line.ends_with(extension)) return false;
    any = true;
  }
  return any;
}

}  // namespace esim::inline formats
