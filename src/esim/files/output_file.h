#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

namespace esim::inline files {

/// Writes a file through a buffer. Every failure is an OutputError with the file name and the reason of the system.
class OutputFile {
 public:
  /// Creates the file, or empties an existing one.
  explicit OutputFile(std::filesystem::path path);

  /// Keeps the first `kept` bytes of an existing file, and continues there. Throws OutputError if it is shorter.
  OutputFile(std::filesystem::path path, std::uint64_t kept);

  /// Closes without writing the buffer, which is empty after close().
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  /// The buffer, to append text to; call flush_if_full() after each portion.
  std::string& buffer() { return buffer_; }
  void append(std::string_view text);

  /// Returns true if it flushed.
  bool flush_if_full();

  /// Replaces the first bytes of the flushed data by `text`.
  void overwrite_start(std::string_view text);

  /// Hands the buffer to the system, so that it survives the end of this process: all of it or, on failure, nothing.
  /// Files that are flushed after whole lines therefore end with a whole line, even on a full disk.
  void flush();

  /// Writes everything to the disk, so that it survives the end of the system.
  void make_durable();

  /// Writes everything to the disk and closes.
  void close();

  const std::filesystem::path& path() const { return path_; }
  std::uint64_t size() const { return flushed_ + buffer_.size(); }  ///< bytes

 private:
  void take_back(std::size_t written);

  std::filesystem::path path_;
  std::string buffer_;
  std::uint64_t flushed_ = 0;  // bytes
  int descriptor_ = -1;
};

/// The suffix of the temporary file of write_file_atomically().
inline constexpr const char* kTemporaryExtension = ".tmp";

/// Replaces the content of the file by `text` in one step: readers see the old or the new content, never a part.
void write_file_atomically(const std::filesystem::path& path, std::string_view text);

/// Creates a folder and its missing parents. Throws OutputError.
void create_folder(const std::filesystem::path& path);

/// Makes a complete file durable.
void sync_file(const std::filesystem::path& path);

/// Makes the names in a directory durable. Does nothing if the file system does not support it.
void sync_directory(const std::filesystem::path& directory);

/// The text of the system for an errno value: "No space left on device".
std::string system_reason(int error_number);

/// Throws OutputError "cannot write FILE: REASON".
[[noreturn]] void throw_cannot_write(const std::filesystem::path& path, std::string_view reason);

}  // namespace esim::inline files
