#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace esim::inline files {

/// Reads a file in order. Every failure is a UserError "cannot read FILE: at byte N: REASON".
class InputFile {
 public:
  explicit InputFile(std::filesystem::path path);
  ~InputFile();
  InputFile(InputFile&& other) noexcept;
  InputFile& operator=(InputFile&& other) noexcept;

  const std::filesystem::path& path() const { return path_; }
  std::uint64_t size() const { return size_; }      ///< bytes
  std::uint64_t offset() const { return offset_; }  ///< position of the next byte

  /// The next bytes, at most so many; fewer only at the end of the file. Borrowed until the next call.
  std::span<const std::byte> read(std::size_t max);

  /// Fills `out` with the next bytes and returns their number; fewer only at the end of the file.
  std::size_t read_into(std::span<std::byte> out);

  /// Exactly so many bytes; if the file ends earlier, fails with "the file ends within WHAT".
  std::span<const std::byte> read_exactly(std::size_t count, std::string_view what);

  /// The next line without its end ("\n" or "\r\n"), or the rest of the file. Fails if it is longer than `max` bytes.
  std::string_view read_line(std::size_t max, std::string_view what);

  /// Continues at another position, at most the end of the file.
  void seek(std::uint64_t offset);

  /// Skips the next bytes.
  void skip(std::uint64_t count);

  /// The fraction of the file before the next byte.
  double progress() const { return size_ > 0 ? static_cast<double>(offset_) / static_cast<double>(size_) : 1.0; }

  [[noreturn]] void fail(std::uint64_t offset, std::string_view reason) const;

 private:
  void fill(std::size_t count);

  std::filesystem::path path_;
  int descriptor_ = -1;
  std::uint64_t size_ = 0, offset_ = 0;
  std::vector<std::byte> buffer_;
  std::size_t begin_ = 0, end_ = 0;  // unread part of the buffer
};

/// Reads the next bytes into a buffer and returns their number; fewer than requested only at the end. Throws UserError.
using Read = std::function<std::size_t(std::span<std::byte>)>;

/// The first bytes of a file, at most so many; empty if it cannot be read.
std::string read_head(const std::filesystem::path& path, std::size_t max);

/// The end of a file's name from its last point on, in lower case: ".obj".
std::string lower_extension(const std::filesystem::path& file);

}  // namespace esim::inline files
