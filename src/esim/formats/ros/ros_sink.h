#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "esim/formats/ros/message_file.h"
#include "esim/formats/ros/messages/event_packet.h"
#include "esim/recording/format.h"

namespace esim::inline formats::ros {

/// Writes a recording as ROS messages on the topics of topics.h. `create` makes the file, with messages in `encoding`;
/// `path` is its name in errors. Events are EventPackets encoded as `packets`; without it, EventArrays. `at_once`: no
/// event waits for later ones. Throws UserError for times that ROS cannot hold.
std::unique_ptr<Sink> make_sink(std::filesystem::path path, Encoding encoding, std::optional<PacketEncoding> packets,
                                std::function<std::unique_ptr<MessageOutput>()> create, bool at_once = false);

/// The variant of a format of messages that writes events as EventPackets: `mono` for times in ns, otherwise `evt3`.
/// `make` makes its sink.
Format with_packets(Format format, std::string name, std::string description,
                    std::unique_ptr<Sink> (*make)(const std::filesystem::path& path, const WriteOptions& options,
                                                  std::optional<PacketEncoding> packets));

}  // namespace esim::inline formats::ros
