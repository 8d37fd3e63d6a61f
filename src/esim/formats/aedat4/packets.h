#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "esim/files/input_file.h"
#include "esim/formats/aedat4/description.h"
#include "esim/formats/aedat4/packing.h"

namespace esim::inline formats::aedat4 {

struct Packet {
  int stream = 0;
  std::uint64_t offset = 0;            ///< byte of the file at which its header starts
  std::span<const std::byte> plain{};  ///< decompressed; borrowed until the next packet
};

/// Reads the packets of a file in their order, without the table at its end.
class PacketReader {
 public:
  explicit PacketReader(const std::filesystem::path& path);

  Packing packing() const { return packing_; }
  const std::vector<Stream>& streams() const { return streams_; }

  /// The earliest and latest time in the table of packets, us, if the table is valid.
  struct Times {
    std::int64_t start_us = 0, end_us = 0;
  };
  std::optional<Times> times() const { return times_; }

  /// Skips packets of streams that are not in `wanted`.
  std::optional<Packet> next(std::span<const int> wanted);

  double progress() const { return file_.progress(); }
  [[noreturn]] void fail(const Packet& packet, std::string_view reason) const { file_.fail(packet.offset, reason); }

 private:
  void read_header();
  void read_data_table();

  InputFile file_;
  Packing packing_ = Packing::none;
  std::vector<Stream> streams_;
  std::optional<Unpacker> unpacker_;
  std::optional<std::uint64_t> data_table_;  // byte at which it starts
  std::optional<Times> times_;
};

bool is_aedat4(std::string_view head);

}  // namespace esim::inline formats::aedat4
