#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "esim/files/input_file.h"

namespace esim::inline files {

/// Reads the lines of a text, of at most 4096 bytes each. Every failure is a UserError "FILE, line N: REASON".
class LineReader {
 public:
  /// Throws UserError if the file cannot be opened.
  explicit LineReader(std::filesystem::path path);

  /// Reads a text of so many bytes, called `path` in messages.
  LineReader(Read read, std::filesystem::path path, std::uintmax_t bytes);

  /// The next line without its end ("\n"), borrowed until the next call; returns false at the end.
  bool next(std::string_view& line);

  [[noreturn]] void fail(const std::string& reason) const;

  /// The fraction of the text that has been read.
  double progress() const { return size_ > 0 ? static_cast<double>(bytes_read_) / static_cast<double>(size_) : 1.0; }

 private:
  std::filesystem::path path_;
  Read read_;
  std::uintmax_t size_ = 0, bytes_read_ = 0;
  std::vector<char> block_;
  std::size_t begin_ = 0, end_ = 0;  // unread part of the block
  bool ended_ = false;
  std::uint64_t line_number_ = 0;
};

}  // namespace esim::inline files
