#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "esim/core/random.h"
#include "esim/event_camera/circuit/circuit_array.h"
#include "esim/event_camera/labels/pending_labels.h"
#include "esim/event_camera/segment_history.h"
#include "esim/events/event_queue.h"

// Private to event_camera.
namespace esim::inline event_camera {

/// The readout of pixels by their circuit. A pixel that fires raises a request and waits, held in reset, until it has
/// been read; then its refractory period begins. Either of two kinds:
///
/// Rows (arbitrated, as in a DAVIS): a row is read when a random time has passed since its first request, and the rows
/// before it have been read. The time is row_wait on average if no other row waits, and twice as long if kRows do. All
/// waiting events of the row get this time. The arbiter is then busy for row_time and the time of these events. A
/// column of which an event is read calls, with the probability column_coupling, each row with a waiting ON event in
/// it: that row is read after kCall.
///
/// Scans (as in a DVXplorer): column x is read at (k + x / width) scan_period, for all integers k. With scan_hold, all
/// columns report the pixels that had fired when the scan began.
class CircuitReadout {
 public:
  CircuitReadout(const ReadoutOptions& options, int width, int height, std::uint64_t seed, std::uint16_t stream);

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
    archive.fixed(self.readings_);
    archive.fixed(self.waiting_on_);
    archive.list(self.in_rows_);
    archive.value(self.free_);
    archive.list(self.rows_);
    archive.fixed(self.due_);
    archive.value(self.epoch_);
    archive.list(self.read_);
    archive.value(self.free_at_);
    archive.value(self.waiting_);
    archive.value(self.released_);
    archive.value(self.delayed_);
    archive.value(self.longest_delay_);
  }

 private:
  static constexpr TimeNs kNoTime = std::numeric_limits<TimeNs>::max();
  static constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

  struct InRow {
    Event request;
    std::uint32_t next;
  };

  static constexpr double kRows = ReadoutOptions::kRowsOfDoubleWait;
  /// From the reading of an event until a row is read that its column has called, ns.
  static constexpr double kCall = 600;

  void take(const Event& request);
  std::size_t next_row() const;
  TimeNs next_service() const;
  void serve(CircuitArray& pixels);
  void call_rows(std::uint16_t column, double now);
  void stamp(CircuitArray& pixels, const Event& request, TimeNs t);
  TimeNs scan_time(const Event& request) const;
  double wait_of(std::uint32_t row);

  ReadoutOptions options_;
  AddressedRandom random_;
  int width_;
  TimeNs scan_, time_stamp_;
  TimeNs usual_delay_;            // of an idle readout, nearly always
  double row_time_, event_time_;  // ns

  std::vector<Event> requests_;            // not yet taken: a heap with the earliest on top
  std::vector<std::uint32_t> first_;       // of each row in in_rows_, or kNone
  std::vector<std::uint32_t> readings_;    // of each row: the number of random numbers it has used
  std::vector<std::uint32_t> waiting_on_;  // waiting ON events of each column
  std::vector<InRow> in_rows_;             // waiting requests, in lists
  std::uint32_t free_ = kNone;             // head of the list of free places in in_rows_
  std::vector<std::uint32_t> rows_;        // with waiting requests, in the order of their first ones
  std::vector<double> due_;                // of each row: when it can be read, ns after the epoch
  TimeNs epoch_ = kNoTime;                 // time of the first request
  double free_at_ = 0;                     // ns after the epoch
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
