#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>

#include "esim/formats/ros/message_file.h"
#include "esim/formats/ros/messages/event_packet.h"
#include "esim/recording/format.h"

namespace esim::inline formats::ros {

/// The largest sensor whose events fit into EventPackets, px.
inline constexpr int kMaxPacketExtent = prophesee::evt3::kMaxExtent;

/// The encoding of packets for times of this unit.
inline PacketEncoding packet_encoding(TimeUnit unit) {
  return unit == TimeUnit::ns ? PacketEncoding::mono : PacketEncoding::evt3;
}

/// Writes a recording as ROS messages on the topics of topics.h. `create` makes the file, with messages in `encoding`;
/// `path` is its name in errors. Events are EventPackets encoded as `packets`; without it, EventArrays. Throws
/// UserError for times that ROS cannot hold.
std::unique_ptr<Sink> make_sink(std::filesystem::path path, Encoding encoding, std::optional<PacketEncoding> packets,
                                std::function<std::unique_ptr<MessageOutput>()> create);

}  // namespace esim::inline formats::ros
