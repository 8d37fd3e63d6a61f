#include "esim/formats/aedat4/packets.h"

#include <algorithm>
#include <cstring>

#include "esim/core/error.h"
#include "esim/formats/aedat4/buffers.h"

namespace esim::inline formats::aedat4 {
namespace {

constexpr std::size_t kMaxHeaderBytes = std::size_t{1} << 24;

std::string_view text(std::span<const std::byte> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

}  // namespace

bool is_aedat4(std::string_view head) { return head.starts_with(kVersionLine); }

PacketReader::PacketReader(const std::filesystem::path& path) : file_(path) {
  read_header();
  const std::uint64_t first_packet = file_.offset();
  if (data_table_ && *data_table_ < first_packet)
    file_.fail(0, "the header is damaged: it overlaps the table of packets");
  read_data_table();
  file_.seek(first_packet);
}

void PacketReader::read_header() {
  const std::string_view version(kVersionLine);
  if (text(file_.read_exactly(version.size(), "the version")) != version) file_.fail(0, "the file is not AEDAT 4.0");
  const std::uint64_t offset = file_.offset();
  std::uint32_t size = 0;
  std::memcpy(&size, file_.read_exactly(sizeof(size), "the header").data(), sizeof(size));
  if (size > kMaxHeaderBytes) file_.fail(offset, "the header is damaged: its stated size is too large");
  file_.seek(offset);
  const auto borrowed = file_.read_exactly(sizeof(size) + size, "the header");
  const std::vector<std::byte> bytes(borrowed.begin(), borrowed.end());  // aligned
  const fb::IOHeader* header = verified<fb::IOHeader>(bytes, "IOHE");
  if (header == nullptr || header->info_node() == nullptr) file_.fail(offset, "the header is damaged");

  const auto packing = static_cast<std::int32_t>(header->compression());
  if (packing < 0 || packing > static_cast<std::int32_t>(Packing::zstd_high)) {
    file_.fail(offset, "unknown compression number: " + std::to_string(packing));
  }
  packing_ = static_cast<Packing>(packing);
  unpacker_.emplace(packing_);
  if (header->data_table_position() >= 0) data_table_ = static_cast<std::uint64_t>(header->data_table_position());
  const auto streams = parse_description(header->info_node()->string_view());
  if (!streams) file_.fail(offset, "the description of the streams is damaged");
  streams_ = *streams;
}

/// Reads the optional table; a damaged or truncated one is ignored.
void PacketReader::read_data_table() {
  if (!data_table_ || *data_table_ >= file_.size() || file_.size() - *data_table_ > Unpacker::kMaxBytes) return;
  file_.seek(*data_table_);
  const auto plain = unpacker_->unpack(file_.read(static_cast<std::size_t>(file_.size() - *data_table_)));
  const fb::DataTable* table = plain ? verified<fb::DataTable>(*plain, "FTAB") : nullptr;
  if (table == nullptr || table->table() == nullptr) return;
  for (const fb::PacketEntry* entry : *table->table()) {
    if (!times_) times_ = {entry->timestamp_start(), entry->timestamp_end()};
    times_->start_us = std::min(times_->start_us, entry->timestamp_start());
    times_->end_us = std::max(times_->end_us, entry->timestamp_end());
  }
}

std::optional<Packet> PacketReader::next(std::span<const int> wanted) {
  while (file_.offset() < data_table_.value_or(file_.size())) {
    Packet packet{.offset = file_.offset()};
    if (data_table_ && file_.offset() == file_.size())
      file_.fail(packet.offset, "the file ends before its last packet");
    fb::PacketHeader header;
    std::memcpy(&header, file_.read_exactly(sizeof(header), "a packet header").data(), sizeof(header));
    packet.stream = header.stream_id();
    const auto size = static_cast<std::uint64_t>(header.size());
    if (header.size() < 0 || size > Unpacker::kMaxBytes) fail(packet, "the size of the packet is invalid");
    if (std::find(wanted.begin(), wanted.end(), packet.stream) == wanted.end()) {
      if (size > file_.size() - file_.offset()) file_.fail(file_.size(), "the file ends within a packet");
      file_.seek(file_.offset() + size);
      continue;
    }
    const auto plain = unpacker_->unpack(file_.read_exactly(size, "a packet"));
    if (!plain) fail(packet, "the packet is damaged: it cannot be decompressed");
    packet.plain = *plain;
    return packet;
  }
  return std::nullopt;
}

}  // namespace esim::inline formats::aedat4
