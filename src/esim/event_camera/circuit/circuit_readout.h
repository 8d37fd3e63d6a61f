#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "esim/event_camera/circuit/circuit_array.h"
#include "esim/event_camera/labels/pending_labels.h"
#include "esim/event_camera/segment_history.h"
#include "esim/events/event_queue.h"

// Private to event_camera.
namespace esim::inline event_camera {

/// The readout of pixels by their circuit. A pixel that fires raises a request and waits, held in reset, until it has
/// been read; then its refractory period begins. Either of two kinds:
///
/// Rows (arbitrated, as in a DAVIS): the arbiter visits the rows in turn, and passes a row without requests in
/// row_scan. In a row with requests, it stamps all waiting events with the time of its visit, and is busy for row_time
/// and the time of these events. It leaves out rows that it has read less than row_rest before. The busier it is, the
/// longer a round takes, and the more events share a stamp.
///
/// Scans (as in a DVXplorer): column x is read at (k + x / width) scan_period, for all integers k. With scan_hold, all
/// columns report the pixels that had fired when the scan began.
class CircuitReadout {
 public:
  CircuitReadout(const ReadoutOptions& options, int width, int height);

  /// The recent segments: add segments before the pixels are advanced through them.
  SegmentHistory history;

  /// Reads out the requests up to the watermark. `found` are new requests. `labels`: of the events, or null.
  void advance(CircuitArray& pixels, EventQueue& found, TimeNs watermark, PendingLabels* labels);

  /// Appends the events with t <= until that were not released before, in order.
  void release_until(TimeNs until, std::vector<Event>& out);

  /// Events that a maximum rate of the pixels has lost since the last call.
  std::int64_t take_lost() { return std::exchange(buffer_.lost, 0); }

  std::int64_t delayed() const { return delayed_; }
  TimeNs longest_delay() const { return longest_delay_; }
  std::size_t waiting() const { return requests_.size() + waiting_ + read_.size() - released_; }

  /// Its state without the history, for core/state_archive.h.
  template <class Archive, class Self>
  static void transfer(Archive& archive, Self& self) {
    archive.list(self.requests_);
    archive.fixed(self.first_);
    archive.fixed(self.last_read_);
    archive.list(self.in_rows_);
    archive.list(self.rows_);
    archive.list(self.visits_);
    archive.value(self.epoch_);
    archive.value(self.position_);
    archive.list(self.read_);
    archive.value(self.free_at_);
    archive.value(self.waiting_);
    archive.value(self.released_);
    archive.value(self.delayed_);
    archive.value(self.longest_delay_);
  }

 private:
  static constexpr TimeNs kNoTime = std::numeric_limits<TimeNs>::max();

  struct InRow {
    Event request;
    std::uint32_t next;
  };

  void take(const Event& request);
  void serve(CircuitArray& pixels);
  void stamp(CircuitArray& pixels, const Event& request, TimeNs t);
  TimeNs scan_time(const Event& request) const;
  /// The time of the arbiter's first visit of a row at `t` or later, if it finds no requests before.
  double visit(std::uint32_t row, double t) const;

  ReadoutOptions options_;
  int width_;
  TimeNs scan_, time_stamp_;
  TimeNs usual_delay_;                          // of an idle readout, at most
  double row_time_, event_time_, pass_, rest_;  // ns

  std::vector<Event> requests_;       // not yet taken: a heap with the earliest on top
  std::vector<std::uint32_t> first_;  // of each row in in_rows_, or kNone
  std::vector<double> last_read_;     // of each row, ns after the epoch
  std::vector<InRow> in_rows_;        // waiting requests, in lists
  std::vector<std::uint32_t> rows_;   // with waiting requests
  std::vector<double> visits_;        // of rows_: when they are read, ns after the epoch
  TimeNs epoch_ = kNoTime;            // time of the first request
  double free_at_ = 0;                // when the arbiter arrives at row position_, ns after the epoch
  std::uint32_t position_ = 0;
  std::size_t waiting_ = 0;
  std::vector<Event> read_;  // in order; the first released_ have been released
  std::size_t released_ = 0;
  std::int64_t delayed_ = 0;
  TimeNs longest_delay_ = 0;
  CircuitBuffer buffer_;
  PendingLabels* labels_ = nullptr;  // during advance()
  std::vector<Event> resumed_;
};

}  // namespace esim::inline event_camera
