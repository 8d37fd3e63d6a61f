// Accelerates (14), find_requests(), raise() and acknowledge() in reference.cpp: most pixels never wait.
#pragma once

#include <compare>
#include <cstdint>
#include <limits>
#include <vector>

#include "esim/event_camera/labels/pending_labels.h"
#include "esim/event_camera/pixel/pixel_update.h"
#include "esim/event_camera/readout/readout.h"
#include "esim/event_camera/segment_history.h"
#include "esim/events/event_queue.h"

// Private to event_camera.
namespace esim::inline event_camera {

/// The readout and its effect on the pixels. A pixel that fires holds its request until it has been read out. Only then
/// its refractory period begins, and its new reference is its brightness at the end of that period. Until then the
/// pixel is blind, so that a readout at its limit reports fewer and later events.
///
/// Pixels are advanced as if each request were acknowledged immediately, which is true for most requests. Otherwise the
/// pixel is reverted to its event, and resumes in the segments after it. A request is never earlier than the time at
/// which its pixel resumes, so that all pixels that resume before the next service are processed together.
class PixelReadout {
 public:
  PixelReadout(const EventCameraOptions& options, int width, int height);

  /// The recent segments: add segments before the pixels are advanced through them.
  SegmentHistory history;

  /// Reads out the requests up to the watermark; all segments must be known up to it. `found` are the events under the
  /// assumption that all requests are acknowledged immediately; events that do not occur are removed. `labels`: of the
  /// events, or null.
  void advance(PixelArray& pixels, PixelUpdate& update, EventQueue& found, TimeNs watermark, PendingLabels* labels);

  /// Appends the events with t <= until that were not released before, in order.
  void release_until(TimeNs until, std::vector<Event>& out);

  std::int64_t dropped() const { return readout_.dropped(); }
  std::int64_t delayed() const { return delayed_; }        ///< events whose pixels had to wait
  TimeNs longest_delay() const { return longest_delay_; }  ///< of any event
  std::size_t waiting() const { return readout_.waiting() + again_.size() + read_.size() - released_; }

  /// Its state without the history, for core/state_archive.h.
  template <class Archive, class Self>
  static void transfer(Archive& archive, Self& self) {
    Readout::transfer(archive, self.readout_);
    archive.fixed(self.states_);
    archive.fixed(self.ignored_);
    archive.fixed(self.blind_until_);
    archive.list(self.again_);
    archive.list(self.read_);
    archive.value(self.released_);
    archive.value(self.delayed_);
    archive.value(self.longest_delay_);
  }

 private:
  static constexpr TimeNs kNoTime = std::numeric_limits<TimeNs>::max();

  /// Flags of a pixel's state.
  enum : std::uint8_t {
    kRequests = 1,    // a request waits to be read out
    kWaits = 2,       // held in reset since the last request: `found` has no later events of it
    kSuperseded = 4,  // the remaining events of the pixel in `found` do not occur
  };

  std::uint32_t index(const Event& event) const {
    return static_cast<std::uint32_t>(event.y) * static_cast<std::uint32_t>(width_) + event.x;
  }
  const Event* next_request(TimeNs watermark);
  bool raises(const Event& request);
  void read_prompt(TimeNs watermark);
  bool read_at_once(const Event& request, bool resumed, TimeNs before);
  void wait(const Event& request);
  void read_row(TimeNs t);
  void stamp(const Event& request, TimeNs t);
  void acknowledge(const Event& request, TimeNs t);
  void release(std::uint32_t pixel, TimeNs until, bool waits, bool late);
  void count_found();
  void resume(PixelUpdate& update);
  void collect();

  Readout readout_;
  int width_;
  TimeNs refractory_;
  bool holds_;        // pixels are held in reset; otherwise their events are dropped
  TimeNs tolerance_;  // an acknowledgement within this time after the request counts as immediate

  // Per pixel.
  std::vector<std::uint8_t> states_;
  std::vector<std::uint32_t> ignored_;  // events in `found` since the waiting request
  std::vector<TimeNs> blind_until_;     // if pixels are not held
  std::vector<std::uint32_t> to_come_;  // events in `found` not processed yet; valid if counted_

  // For one advance().
  PixelArray* pixels_ = nullptr;
  EventQueue* found_ = nullptr;
  PendingLabels* labels_ = nullptr;  // null: none are wanted
  EventSpan arrived_;                // events in `found` up to the watermark
  std::size_t next_ = 0;             // index into arrived_
  bool counted_ = false;
  std::vector<std::uint32_t> superseded_, to_draw_;  // pixels

  struct Resuming {
    std::uint32_t segment, pixel;
    friend auto operator<=>(const Resuming&, const Resuming&) = default;
  };
  std::vector<Resuming> resuming_, still_resuming_;
  TimeNs first_resumes_ = kNoTime;  // the earliest time at which one resumes
  std::vector<std::uint32_t> together_;

  std::vector<Event> again_;  // requests of resumed pixels: a heap with the earliest on top
  EventPacking packing_;
  PackedEvents packed_;

  std::vector<Event> read_;  // in order; the first released_ have been released
  std::size_t released_ = 0;
  std::int64_t delayed_ = 0;
  TimeNs longest_delay_ = 0;
};

}  // namespace esim::inline event_camera
