#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "esim/files/input_file.h"

struct zip;  // libzip's archive

namespace esim::inline files {

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

}  // namespace esim::inline files
