#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

#include "esim/core/time.h"
#include "esim/events/event.h"
#include "esim/events/event_label.h"
#include "esim/recording/format.h"

namespace esim::inline formats {

struct EventsHdf5Options {
  TimeUnit unit = TimeUnit::us;
  Compression compression = Compression::blosc;
};

/// Events of one camera in DSEC's layout:
///
///   events/t   uint32 or uint64 [N]   time since t_offset, rounded down to the unit
///   events/x, events/y  uint16 [N]    px
///   events/p   uint8 [N]              1: ON, 0: OFF
///   ms_to_idx  uint64 [M]             ms_to_idx[ms] = first i with t[i] >= ms milliseconds, otherwise N
///   t_offset   int64                  start of the recording, rounded down to the unit; if unknown, to a second
///
/// and, if the camera has labels, for each event
///
///   events/labels/t_ideal   int64 [N]  as t, but of the ideal crossing
///   events/labels/signal, flicker, noise, leak  float32 [N]   parts of the change, ln
///   events/labels/object, semantic_class  uint16 [N]
///   events/labels/cause     uint8 [N]  0: signal, 1: flicker, 2: noise, 3: leak; also in its attribute "names"
///   events/labels/hot       uint8 [N]  1: the pixel is hot
///
/// with M = 1 + the duration in ms, rounded up. M covers at least the time just after the last event, since readers
/// such as DSEC's look up the first millisecond at or after the end of a window.
///
/// Attributes beyond DSEC: unit ("us" or "ns"), width, height and esim_complete of the file: 0 while it is being
/// written or if the recording was interrupted, 1 if it is complete. t is uint32 if the planned duration in µs is known
/// and fits. Memory does not grow with the recording. The same events give the same bytes in batches of any size. A
/// killed process loses at most its last 65536 events.
class EventsHdf5Writer final : public Sink {
 public:
  /// Throws UserError if the compression is not available.
  EventsHdf5Writer(std::filesystem::path path, int camera, EventsHdf5Options options = {});
  ~EventsHdf5Writer() override;

  void begin(const RecordingInfo& info) override;
  void write(const Record& record) override;
  void end(bool complete) override;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

Format dsec_format();

/// Reads files of EventsHdf5Writer and DSEC's own files, which lack the attributes. Other, damaged or truncated files
/// are a UserError that names the file.
class EventsHdf5Reader {
 public:
  explicit EventsHdf5Reader(std::filesystem::path path);
  ~EventsHdf5Reader();
  EventsHdf5Reader(EventsHdf5Reader&&) noexcept;
  EventsHdf5Reader& operator=(EventsHdf5Reader&&) noexcept;

  std::uint64_t size() const;            ///< number of events
  std::optional<int> width() const;      ///< px, if the file states it
  std::optional<int> height() const;     ///< px, if the file states it
  TimeUnit unit() const;                 ///< µs if the file does not state it
  TimeNs t_offset() const;               ///< ns, whatever the file's unit
  std::optional<bool> complete() const;  ///< esim_complete, if the file states it

  std::optional<TimeSpan> time_span() const;  ///< span of the events; nothing if there are no events

  /// End of the recording: that of ms_to_idx, rounded up to a ms, or the last event.
  TimeNs end() const;

  /// Up to `count` events from index `first` on; fewer at the end.
  std::vector<Event> read(std::uint64_t first, std::uint64_t count) const;

  struct IndexRange {
    std::uint64_t first = 0, end = 0;
  };
  /// Indices of the events with t0 <= t < t1, found through ms_to_idx.
  IndexRange find(TimeNs t0, TimeNs t1) const;
  std::vector<Event> read_window(TimeNs t0, TimeNs t1) const;

  bool has_labels() const;
  /// Appends the labels of events that exist; only if the file has labels.
  void read_labels(std::uint64_t first, std::uint64_t count, std::vector<EventLabel>& labels) const;

  /// Number of ON events; reads only the polarities.
  std::uint64_t count_on() const;

  /// Up to `count` polarities from index `first` on: above 0 for ON. Reads only the polarities.
  std::vector<std::int8_t> read_polarities(std::uint64_t first, std::uint64_t count) const;

  /// For each ms since t_offset, the index of the first event at or after it; empty if the file has no such index.
  /// Throws UserError if the indices decrease.
  std::vector<std::uint64_t> ms_to_idx() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace esim::inline formats
