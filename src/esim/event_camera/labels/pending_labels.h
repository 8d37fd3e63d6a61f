// Keeps what reference.cpp stores with each event while it waits: its label.
#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include "esim/core/time.h"
#include "esim/event_camera/options.h"
#include "esim/events/event.h"
#include "esim/events/event_label.h"

// Private to event_camera.
namespace esim::inline event_camera {

/// The labels of the events that are still in the camera. Labels do not travel with their events: they wait here, in
/// one list per pixel, and are joined with the events when these leave the camera. The pixel, the time stamp and the
/// polarity identify an event; of equal events, the first crossing comes first.
class PendingLabels {
 public:
  /// `hot`: whether each pixel is hot; empty: none is.
  PendingLabels(int width, int height, std::vector<bool> hot);

  /// Takes the labels of new events, and empties the list. Those of a pixel must be in the order of their crossings.
  void add(std::vector<NewLabel>& labels);

  // What a readout does to events. A readout must pass each event that leaves the camera through read().

  /// The request has been read at `t`, the new time stamp.
  void read(const Event& request, TimeNs t);
  /// The same for several: read[i] is what became of requests[i].
  void read(EventSpan requests, EventSpan read);
  /// The request is lost.
  void drop(const Event& request);
  /// All requests of a pixel that have not been read are lost.
  void drop_unread(std::uint32_t pixel);

  /// Appends the labels of events that leave the camera, in their order, and forgets them.
  void take(EventSpan events, std::vector<EventLabel>& labels);

  /// The earliest crossing among the labels; the maximum time without labels.
  TimeNs earliest() const;

  /// A label and whether its event has been read, for core/state_archive.h.
  struct Waiting {
    NewLabel label;
    std::uint64_t was_read = 0;
  };
  std::vector<Waiting> waiting() const;
  /// Returns false if a pixel does not exist.
  bool restore(std::span<const Waiting> labels);

 private:
  static constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max(), kRemoved = kNone - 1;

  struct Node {
    NewLabel label;
    std::uint32_t next = kNone;
    bool was_read = false;
  };
  struct List {
    std::uint32_t first = kNone, last = kNone;
  };

  std::uint32_t pixel_of(const Event& event) const { return static_cast<std::uint32_t>(event.y) * width_ + event.x; }
  template <class Body>
  void for_each(EventSpan events, const Body& body);
  void insert(const NewLabel& label, bool was_read);
  void forget_removed();
  /// The node before the event's (kNone: it is the first) and the event's. Throws InternalError if it does not exist.
  std::pair<std::uint32_t, std::uint32_t> find(const Event& event, bool was_read) const;
  void remove(List& list, std::uint32_t before, std::uint32_t node);

  std::uint32_t width_;
  std::vector<bool> hot_;
  std::vector<List> lists_;  // per pixel
  std::vector<Node> nodes_;  // in the order of add(), so that new ones are written to memory one after another
  std::size_t removed_ = 0;  // of nodes_
  std::vector<Node> spare_;  // memory for forget_removed()
};

}  // namespace esim::inline event_camera
