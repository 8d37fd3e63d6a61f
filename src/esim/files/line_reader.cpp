#include "esim/files/line_reader.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <utility>

#include "esim/core/error.h"
#include "esim/files/output_file.h"

namespace esim::inline files {
namespace {

constexpr std::size_t kMaxLineBytes = 1 << 12;

std::unique_ptr<std::istream> open(const std::filesystem::path& path) {
  std::error_code error;
  if (std::filesystem::is_directory(path, error)) {
    throw UserError("cannot read " + path.string() + ": it is a directory");
  }
  auto file = std::make_unique<std::ifstream>(path, std::ios::binary);
  if (!*file) throw UserError("cannot read " + path.string() + ": " + system_reason(errno));
  return file;
}

std::uintmax_t size_of(const std::filesystem::path& path) {
  std::error_code error;
  const std::uintmax_t size = std::filesystem::file_size(path, error);
  return error ? 0 : size;
}

}  // namespace

LineReader::LineReader(std::filesystem::path path) : LineReader(open(path), path, size_of(path)) {}

LineReader::LineReader(std::unique_ptr<std::istream> text, std::filesystem::path path, std::uintmax_t bytes)
    : path_(std::move(path)), text_(std::move(text)), size_(bytes), block_(std::size_t{1} << 18) {}

void LineReader::fail(const std::string& reason) const {
  throw UserError(path_.string() + ", line " + std::to_string(line_number_) + ": " + reason);
}

bool LineReader::next(std::string_view& line) {
  const auto find_newline = [&] { return std::find(block_.begin() + begin_, block_.begin() + end_, '\n'); };
  auto newline = find_newline();
  if (newline == block_.begin() + end_ && *text_) {
    // Moves the rest of the block to its start and reads more text after it.
    std::memmove(block_.data(), block_.data() + begin_, end_ - begin_);
    end_ -= std::exchange(begin_, 0);
    text_->read(block_.data() + end_, static_cast<std::streamsize>(block_.size() - end_));
    end_ += static_cast<std::size_t>(text_->gcount()), read_ += static_cast<std::uintmax_t>(text_->gcount());
    if (text_->bad()) fail("the file cannot be read further");
    newline = find_newline();
  }
  if (begin_ == end_) return false;
  ++line_number_;
  line = std::string_view(block_.data() + begin_, static_cast<std::size_t>(newline - block_.begin()) - begin_);
  if (line.size() > kMaxLineBytes) fail("the line is too long");
  begin_ += std::min(line.size() + 1, end_ - begin_);
  return true;
}

}  // namespace esim::inline files
