#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

namespace esim {

/// A file being written: buffered, and every failure is an OutputError with the file's name and the system's reason.
class OutputFile {
 public:
  /// Creates the file, or empties the one that is there.
  explicit OutputFile(std::filesystem::path path);

  /// Closes without writing what is still buffered: after close() nothing is.
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  /// Room to append text to; call flush_if_full() after each portion.
  std::string& buffer() { return buffer_; }
  void append(std::string_view text);

  /// True where it has flushed.
  bool flush_if_full();

  /// Replaces the first bytes of what has been flushed, as many as `text` has.
  void overwrite_start(std::string_view text);

  /// Hands what is buffered to the system, so that it survives the end of this process: all of it or, where that fails,
  /// none. Files that are flushed after whole lines so end with one, also on a full disk.
  void flush();

  /// Writes everything to the disk and closes.
  void close();

  const std::filesystem::path& path() const { return path_; }

 private:
  void take_back(std::size_t written);

  std::filesystem::path path_;
  std::string buffer_;
  std::uint64_t flushed_ = 0;  // bytes
  int descriptor_ = -1;
};

/// What write_file_atomically() appends to the name of the file that it writes first.
inline constexpr const char* kTemporaryExtension = ".tmp";

/// Puts `text` into the file at once: readers see the old content or the new one, never a part.
void write_file_atomically(const std::filesystem::path& path, std::string_view text);

/// Creates a folder, and those that it is in, where they are missing. Throws OutputError.
void create_folder(const std::filesystem::path& path);

/// Makes a file that is whole durable.
void sync_file(const std::filesystem::path& path);

/// Makes the names in a directory durable. Silent where the file system cannot do that.
void sync_directory(const std::filesystem::path& directory);

/// The system's words for an errno value: "No space left on device".
std::string system_reason(int error_number);

/// An OutputError: "cannot write FILE: REASON".
[[noreturn]] void throw_cannot_write(const std::filesystem::path& path, std::string_view reason);

}  // namespace esim
