#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace esim {

/// A file being read in order. Every failure is a UserError "cannot read FILE: at byte N: REASON".
class InputFile {
 public:
  explicit InputFile(std::filesystem::path path);
  ~InputFile();
  InputFile(InputFile&& other) noexcept;
  InputFile& operator=(InputFile&& other) noexcept;

  const std::filesystem::path& path() const { return path_; }
  std::uint64_t size() const { return size_; }      ///< bytes
  std::uint64_t offset() const { return offset_; }  ///< of the byte that is read next

  /// The next bytes, at most so many; fewer only where the file ends. Borrowed until the next call.
  std::span<const std::byte> read(std::size_t most);

  /// Fills `out` with the next bytes; how many, fewer only where the file ends.
  std::size_t read_into(std::span<std::byte> out);

  /// Exactly so many; fails where the file ends before, saying that `what` is cut off there.
  std::span<const std::byte> read_exactly(std::size_t count, std::string_view what);

  /// The next line without its end ("\n" or "\r\n"), or what is left of the file. Fails where it is longer than
  /// `most` bytes.
  std::string_view read_line(std::size_t most, std::string_view what);

  /// Continues at another place; not after the file's end.
  void seek(std::uint64_t offset);

  /// Passes over the next bytes.
  void skip(std::uint64_t count);

  /// The share of the file before the next byte.
  double progress() const { return size_ > 0 ? static_cast<double>(offset_) / static_cast<double>(size_) : 1.0; }

  [[noreturn]] void fail(std::uint64_t offset, std::string_view reason) const;

 private:
  void fill(std::size_t count);

  std::filesystem::path path_;
  int descriptor_ = -1;
  std::uint64_t size_ = 0, offset_ = 0;
  std::vector<std::byte> buffer_;
  std::size_t begin_ = 0, end_ = 0;  // what of the buffer is not read yet
};

/// The first bytes of a file, at most so many: none where it cannot be read.
std::string read_head(const std::filesystem::path& path, std::size_t most);

}  // namespace esim
