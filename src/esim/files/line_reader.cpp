#include "esim/files/line_reader.h"

#include <algorithm>
#include <cstring>
#include <memory>
#include <utility>

#include "esim/core/error.h"

namespace esim::inline files {
namespace {

constexpr std::size_t kMaxLineBytes = 1 << 12;

}  // namespace

LineReader::LineReader(std::filesystem::path path) : path_(std::move(path)), block_(std::size_t{1} << 18) {
  const auto file = std::make_shared<InputFile>(path_);
  size_ = file->size();
  read_ = [file](std::span<std::byte> out) { return file->read_into(out); };
}

LineReader::LineReader(Read read, std::filesystem::path path, std::uintmax_t bytes)
    : path_(std::move(path)), read_(std::move(read)), size_(bytes), block_(std::size_t{1} << 18) {}

void LineReader::fail(const std::string& reason) const {
  throw UserError(path_.string() + ", line " + std::to_string(line_number_) + ": " + reason);
}

bool LineReader::next(std::string_view& line) {
  const auto find_newline = [&] { return std::find(block_.begin() + begin_, block_.begin() + end_, '\n'); };
  auto newline = find_newline();
  if (newline == block_.begin() + end_ && !ended_) {
    // Moves the rest of the block to its start and reads more text after it.
    std::memmove(block_.data(), block_.data() + begin_, end_ - begin_);
    end_ -= std::exchange(begin_, 0);
    const std::span<char> rest = std::span(block_).subspan(end_);
    const std::size_t count = read_(std::as_writable_bytes(rest));
    ended_ = count < rest.size();
    end_ += count, bytes_read_ += count;
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
