#include "esim/dataset/files/checksum.h"

#include <fmt/format.h>
#include <zlib.h>

#include <fstream>

#include "esim/core/error.h"

namespace esim::inline dataset {

std::uint32_t crc32(std::string_view bytes, std::uint32_t before) {
  return static_cast<std::uint32_t>(::crc32_z(before, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

FileChecksum checksum_of(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::string block(std::size_t{1} << 20, '\0');
  FileChecksum result;
  while (file.read(block.data(), static_cast<std::streamsize>(block.size())), file.gcount() > 0) {
    const auto bytes = static_cast<std::size_t>(file.gcount());
    result.crc32 = crc32(std::string_view(block).substr(0, bytes), result.crc32);
    result.bytes += bytes;
  }
  if (!file.eof()) throw UserError(path.string() + ": cannot be read");
  return result;
}

std::string checksum_text(std::uint32_t checksum) { return fmt::format("{:08x}", checksum); }

}  // namespace esim::inline dataset
