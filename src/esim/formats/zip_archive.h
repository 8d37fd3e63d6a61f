#pragma once

#include <cstdint>
#include <deque>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "esim/files/input_file.h"

struct zip;  // libzip's archive

namespace esim::inline formats {

/// Reads the files in a zip, through libzip. Failures are UserErrors that name the zip and the file in it.
class ZipReader {
 public:
  explicit ZipReader(std::filesystem::path path);

  struct Member {
    std::string name{};
    std::uint64_t bytes = 0;  ///< uncompressed, as the zip states; it may be wrong
  };
  const std::vector<Member>& members() const { return members_; }

  /// Reads a file from its start; call from one thread at a time. All data before damage are read before the error.
  Read open(std::size_t member) const;

  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
  std::shared_ptr<::zip> archive_;
  std::vector<Member> members_;
};

/// Packs files into a zip, through libzip. Nothing is read or written before close(). The same content gives the same
/// bytes, and each file's header states its size, for programs that do not read the list at the end of the zip.
/// Failures are OutputErrors.
class ZipWriter {
 public:
  explicit ZipWriter(std::filesystem::path path);

  enum class Packing { stored, deflated };

  void add_file(const std::string& name, const std::filesystem::path& file, Packing packing);
  void add(const std::string& name, std::string content, Packing packing);

  /// Writes the zip and makes it durable.
  void close();

 private:
  void add_source(const std::string& name, void* source, Packing packing);
  [[noreturn]] void fail() const;

  std::filesystem::path path_;
  std::deque<std::string> contents_;
  std::unique_ptr<::zip, void (*)(::zip*)> archive_;
};

}  // namespace esim::inline formats
