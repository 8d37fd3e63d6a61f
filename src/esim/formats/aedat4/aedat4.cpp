#include "esim/formats/aedat4/aedat4.h"

#include "esim/core/error.h"
#include "esim/formats/aedat4/packets.h"
#include "esim/formats/aedat4/reader.h"
#include "esim/formats/aedat4/writer.h"

namespace esim::inline formats {
namespace {

Format format(aedat4::Packing packing) {
  return {
      .holds = {Content::events, Content::frames, Content::imu, Content::triggers},
      .several_cameras = true,
      .resolution = kNsPerUs,
      .max_width = 32768,
      .max_height = 32768,
      .recognises = [](const auto&, std::string_view head) { return aedat4::is_aedat4(head); },
      .open = aedat4::open_reader,
      .create =
          [packing](const auto& path, const WriteOptions& options) {
            const bool plain = options.compression == Compression::none;
            return aedat4::make_writer(path, plain ? aedat4::Packing::none : packing);
          },
  };
}

bool is_packed_with_zstd(const std::filesystem::path& path) {
  try {
    return aedat4::PacketReader(path).packing() >= aedat4::Packing::zstd;
  } catch (const UserError&) {  // the other format reports the problem
    return false;
  }
}

}  // namespace

Format aedat4_format() {
  Format result = format(aedat4::Packing::lz4);
  result.name = "aedat4";
  result.description = "AEDAT 4.0 of iniVation's DV";
  result.extensions = {".aedat4"};
  return result;
}

Format aedat4_zstd_format() {
  Format result = format(aedat4::Packing::zstd);
  result.name = "aedat4-zstd";
  result.description = "AEDAT 4.0, compressed with Zstd";
  result.recognises = [](const std::filesystem::path& path, std::string_view head) {
    return aedat4::is_aedat4(head) && is_packed_with_zstd(path);
  };
  return result;
}

}  // namespace esim::inline formats
