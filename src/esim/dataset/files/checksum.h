#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

namespace esim::inline dataset {

/// The CRC-32 of `bytes`, continued from `before`, as in zlib, gzip and Python's zlib.crc32.
std::uint32_t crc32(std::string_view bytes, std::uint32_t before = 0);

struct FileChecksum {
  std::uint64_t bytes = 0;
  std::uint32_t crc32 = 0;
};

/// The CRC-32 of a file's content. Throws UserError if the file cannot be read.
FileChecksum checksum_of(const std::filesystem::path& path);

/// Eight hexadecimal digits.
std::string checksum_text(std::uint32_t checksum);

}  // namespace esim::inline dataset
