#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "esim/events/event.h"
#include "esim/formats/prophesee/evt3_words.h"
#include "esim/formats/ros/messages/messages.h"

namespace esim::inline formats::ros {

/// event_camera_msgs/EventPacket: what the drivers of event cameras publish in ROS 2.
struct EventPacketMessage {
  Header header{};
  std::uint32_t height = 0, width = 0;  // px
  std::uint64_t seq = 0;                ///< number of the message, so that lost ones are noticed
  std::uint64_t time_base = 0;          ///< ns
  std::string encoding{};               ///< of the events
  std::uint8_t is_bigendian = 0;
  Bytes events{};

  template <typename Self, typename Archive>
  static void fields(Self& self, Archive& archive) {
    archive(self.header, self.height, self.width, self.seq, self.time_base, self.encoding, self.is_bigendian,
            self.events);
  }
};

/// Decodes the packets of one camera, in their order. The encodings are those of the ROS package event_camera_codecs:
/// evt3, mono, libcaer, libcaer_cmp and trigger.
///
/// The times of evt3, mono and trigger are those of the sensor's clock. They are shifted so that the first one equals
/// the stamp of its packet, since the other messages of a recording have times of that kind.
class EventPacketDecoder {
 public:
  struct Trigger {
    TimeNs t;
    bool rising;
  };

  /// Replaces both. Throws Malformed if the packet is damaged or has another encoding.
  void decode(const EventPacketMessage& packet, std::vector<Event>& events, std::vector<Trigger>& triggers);

 private:
  void decode_evt3(Bytes words, std::vector<Event>& events, std::vector<Trigger>& triggers);

  prophesee::evt3::Decoder evt3_;
  std::vector<std::uint16_t> words_;
  std::optional<TimeNs> shift_;  // from the sensor's clock
};

/// How packets hold events.
enum class PacketEncoding {
  evt3,  ///< times in us; 2 to 6 bytes an event
  mono,  ///< times in ns; 8 bytes an event
};

/// Encodes the packets of one camera, in their order.
class EventPacketEncoder {
 public:
  explicit EventPacketEncoder(PacketEncoding encoding) : encoding_(encoding) {}

  /// Sets all fields but frame_id and the size of the sensor. `events` is not empty, and shorter than 4 s. The bytes
  /// are borrowed until the next call.
  void encode(EventSpan events, EventPacketMessage& packet);

 private:
  PacketEncoding encoding_;
  std::uint64_t count_ = 0;
  prophesee::evt3::Encoder evt3_;
  std::string mono_;
};

}  // namespace esim::inline formats::ros
