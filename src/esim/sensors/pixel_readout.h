#pragma once

#include <compare>
#include <cstdint>
#include <limits>
#include <vector>

#include "esim/events/event_queue.h"
#include "esim/sensors/pixel_update.h"
#include "esim/sensors/readout.h"
#include "esim/sensors/segment_history.h"

namespace esim {

/// The readout, and what it does to the pixels. A pixel that fires holds its request until that has been read out. Only
/// then does its refractory period begin, and its reference is its brightness at the end of that period. It sees
/// nothing meanwhile, so that a readout that cannot follow reports fewer events, and later ones.
///
/// Pixels are advanced as if each request were acknowledged at once, which is true of most. Where one was not, the
/// pixel is taken back to its event, and resumes in the segments that it has gone through since. A request never comes
/// before its pixel resumes, so that all pixels that resume before the next service do so together.
///
/// Private to the event camera.
class PixelReadout {
 public:
  PixelReadout(const EventCameraOptions& options, int width, int height);

  /// What the pixels see: to be told of segments before the pixels are advanced through them.
  SegmentHistory history;

  /// Reads out what has been requested until the watermark, until when all segments must be known. `found` are the
  /// events of pixels whose requests are all acknowledged at once; those that do not happen are removed.
  void advance(PixelArray& pixels, PixelUpdate& update, EventQueue& found, TimeNs watermark);

  /// Appends the events with t <= until that were not released before, in order.
  void release_until(TimeNs until, std::vector<Event>& out);

  std::int64_t dropped() const { return readout_.dropped(); }
  std::int64_t delayed() const { return delayed_; }        ///< events whose pixels had to wait
  TimeNs longest_delay() const { return longest_delay_; }  ///< of any event
  std::size_t waiting() const { return readout_.waiting() + again_.size() + read_.size() - released_; }

  /// What it remembers besides the history, for state_archive.h.
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

  /// Of a pixel's state.
  enum : std::uint8_t {
    kRequests = 1,    // a request waits to be read out
    kWaits = 2,       // held in reset since the last request: nothing was found for later
    kSuperseded = 4,  // what is left of `found` does not happen
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
  TimeNs tolerance_;  // an acknowledgement that comes sooner after the request counts as immediate

  // By pixel.
  std::vector<std::uint8_t> states_;
  std::vector<std::uint32_t> ignored_;  // of `found`, since the request that waits
  std::vector<TimeNs> blind_until_;     // where pixels are not held
  std::vector<std::uint32_t> to_come_;  // of `found`, not looked at yet; in use where counted_

  // Of one advance().
  PixelArray* pixels_ = nullptr;
  EventQueue* found_ = nullptr;
  EventSpan arrived_;     // of `found`, until the watermark
  std::size_t next_ = 0;  // of these
  bool counted_ = false;
  std::vector<std::uint32_t> superseded_, to_draw_;  // pixels

  struct Resuming {
    std::uint32_t segment, pixel;
    friend auto operator<=>(const Resuming&, const Resuming&) = default;
  };
  std::vector<Resuming> resuming_, still_resuming_;
  TimeNs first_resumes_ = kNoTime;  // the earliest of them
  std::vector<std::uint32_t> together_;

  std::vector<Event> again_;  // requests of pixels that have resumed: a heap, the first on top
  EventPacking packing_;
  PackedEvents packed_;

  std::vector<Event> read_;  // in order; the first released_ are gone
  std::size_t released_ = 0;
  std::int64_t delayed_ = 0;
  TimeNs longest_delay_ = 0;
};

}  // namespace esim
