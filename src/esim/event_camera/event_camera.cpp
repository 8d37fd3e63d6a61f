#include "esim/event_camera/event_camera.h"

#include <algorithm>
#include <atomic>
#include <limits>
#include <optional>
#include <string>
#include <utility>

#include "esim/core/error.h"
#include "esim/core/state_archive.h"
#include "esim/event_camera/center_surround.h"
#include "esim/event_camera/circuit/circuit_array.h"
#include "esim/event_camera/circuit/circuit_readout.h"
#include "esim/event_camera/front_end.h"
#include "esim/event_camera/labels/pending_labels.h"
#include "esim/event_camera/pixel/pixel_array.h"
#include "esim/event_camera/pixel/pixel_update.h"
#include "esim/event_camera/pixel/pixel_watch.h"
#include "esim/event_camera/readout/pixel_readout.h"
#include "esim/events/event_queue.h"
#include "esim/filters/labels_of_passed.h"
#include "esim/render/irradiance_check.h"

namespace esim::inline event_camera {
namespace {

constexpr int kPixelsPerPiece = 4096;  // per task of a parallel loop

/// Divides the rows of a tile into tasks of a parallel loop.
struct RowPieces {
  int first, last, rows, count;

  explicit RowPieces(const Tile& tile)
      : first(tile.y),
        last(tile.y + tile.height),
        rows(std::max(1, kPixelsPerPiece / std::max(1, tile.width))),
        count((tile.height + rows - 1) / rows) {}
  int begin(int piece) const { return first + piece * rows; }
  int end(int piece) const { return std::min(begin(piece) + rows, last); }
};

}  // namespace

/// From irradiance to events: surround, pixels, queue, readout, filters.
struct EventCamera::State {
  State(const EventCameraOptions& options, int width, int height, std::uint64_t seed, std::uint16_t stream)
      : pixels(options, options.circuit ? 0 : width, options.circuit ? 0 : height, seed, stream),
        packing(width, height),
        size{0, 0, width, height},
        queue(width, height) {
    check(options);
    refuse(find_problem(options.filters, width, height), "event_camera.filters.");
    if (options.circuit) circuit.emplace(options, width, height, seed, stream);
    if (options.surround_px > 0) surround.emplace(options.surround_px, options.surround_ms * 1e-3, width, height);
    if (!options.circuit && options.readout.limited()) readout.emplace(options, width, height);
    if (options.circuit && options.readout.acknowledges())
      circuit_readout.emplace(options.readout, width, height, seed, stream);
    if (options.labels) labels.emplace(width, height, circuit ? circuit->hot() : pixels.hot(seed, stream));
    if (options.filters.any()) filters.emplace(options.filters, width, height);
  }

  EventSpan read_out_until(TimeNs until);
  EventSpan filter(EventSpan unfiltered);
  bool integrate(const Workers& workers);
  bool integrate_one(std::size_t i, const Workers& workers);
  bool integrate_tiles(const Workers& workers);
  bool advance(std::size_t i, const Image<float>* given, Rows rows, int worker);
  void refuse_long_time(TimeNs duration) const;
  std::span<const Segment> divide(std::span<const Segment> given);
  void subtract_surround(const Segment& segment, const Workers& workers);

  /// Everything except working memory and the queue.
  template <class Archive, class Self>
  static void transfer(Archive& archive, Self& self) {
    PixelArray::transfer(archive, self.pixels);
    if (self.circuit) CircuitArray::transfer(archive, *self.circuit);
    if (self.surround) CenterSurround::transfer(archive, *self.surround);
    if (self.readout) PixelReadout::transfer(archive, *self.readout);
    if (self.circuit_readout) CircuitReadout::transfer(archive, *self.circuit_readout);
    if (self.labels) archive.value(self.watermark);
    if (self.filters) FilterChain::transfer(archive, *self.filters);
    archive.value(self.read_out);
    archive.value(self.spoiled);
    archive.value(self.lost);
    archive.value(self.last_time);
    archive.value(self.frames);
    if (self.frames > 0) archive.image(self.last_frame);
  }

  PixelArray pixels;  // without pixels if there is a circuit
  std::optional<CircuitArray> circuit;
  std::vector<CircuitBuffer> buffers;  // per worker
  EventPacking packing;
  Tile size;
  bool spoiled = false;   // a segment was integrated only partly
  std::int64_t lost = 0;  // events beyond the maximum rate of their pixels
  std::optional<CenterSurround> surround;
  Image<float> brightness;               // minus the surround
  std::vector<PixelUpdate> updates;      // per worker
  std::vector<PackedEvents> events;      // per worker
  std::span<const Segment> segments;     // being integrated
  std::vector<std::size_t> tile_begins;  // first segment of each group of tiles, and the end
  EventQueue queue;
  std::optional<PixelReadout> readout;
  std::optional<CircuitReadout> circuit_readout;
  std::optional<FilterChain> filters;
  std::vector<Event> from_readout, filtered;
  std::int64_t read_out = 0;  // number of events

  std::optional<PendingLabels> labels;
  std::vector<EventLabel> released_labels;
  TimeNs watermark = std::numeric_limits<TimeNs>::min();

  // For process().
  Image<float> last_frame, next_frame;
  TimeNs last_time = 0;
  std::int64_t frames = 0;
};

EventCamera::EventCamera(const EventCameraOptions& options, int width, int height, std::uint64_t seed,
                         std::uint16_t stream)
    : state_(std::make_unique<State>(options, width, height, seed, stream)) {}

EventCamera::~EventCamera() = default;
EventCamera::EventCamera(EventCamera&&) noexcept = default;
EventCamera& EventCamera::operator=(EventCamera&&) noexcept = default;

void EventCamera::State::subtract_surround(const Segment& segment, const Workers& workers) {
  if (segment.tile != size)
    throw UserError(
        "event camera: surround_px requires samples of whole images; choose a sampling type that gives them");
  if (brightness.empty()) brightness = Image<float>(size.width, size.height);
  workers.for_each(size.height, [&](int y) {
    respond(pixels.options, static_cast<std::size_t>(size.width), segment.irradiance1.row(y), brightness.row(y));
  });
  if (segment.t0 == segment.t1) {
    surround->open(brightness);
  } else {
    surround->advance(brightness, to_seconds(segment.t1 - segment.t0));
  }
}

/// Refuses durations that packed events, including latencies, cannot represent.
void EventCamera::State::refuse_long_time(TimeNs duration) const {
  const TimeNs longest = packing.longest() / 2;
  if (duration < longest) return;
  throw UserError("event camera: two samples are " + std::to_string(to_seconds(duration)) +
                  " s apart; the interval must be shorter than " + std::to_string(to_seconds(longest)) + " s");
}

/// The segments as pixels with a circuit need them.
std::span<const Segment> EventCamera::State::divide(std::span<const Segment> given) {
  for (const Segment& segment : given) {
    if (segment.t0 == segment.t1) circuit->set_epoch(segment.t0);
  }
  return circuit->divide(given);
}

/// Integrates rows of the i-th segment.
bool EventCamera::State::advance(std::size_t i, const Image<float>* given, Rows rows, int worker) {
  const Segment& segment = segments[i];
  if (circuit) {
    if (segment.t0 == segment.t1) return circuit->open(segment, rows);
    PastSegment* const past = circuit_readout ? &circuit_readout->history.added(i) : nullptr;
    return circuit->advance(segment, rows, buffers[static_cast<std::size_t>(worker)], past,
                            events[static_cast<std::size_t>(worker)]);
  }
  PixelUpdate& update = updates[static_cast<std::size_t>(worker)];
  if (segment.t0 == segment.t1) return update.open(pixels, segment, given, rows);
  PastSegment* const past = readout ? &readout->history.added(i) : nullptr;
  return update.advance(pixels, segment, given, rows, past, events[static_cast<std::size_t>(worker)]);
}

/// Integrates the rows of the i-th segment in parallel.
bool EventCamera::State::integrate_one(std::size_t i, const Workers& workers) {
  const Segment& segment = segments[i];
  const Image<float>* given = nullptr;
  if (surround) {
    subtract_surround(segment, workers);
    given = &brightness;
  }
  const RowPieces pieces(segment.tile);
  std::atomic<bool> valid = true;
  workers.for_each_with_worker(pieces.count, [&](int piece, int worker) {
    if (!advance(i, given, {pieces.begin(piece), pieces.end(piece)}, worker)) valid = false;
  });
  return valid;
}

/// Integrates several tiles in parallel.
bool EventCamera::State::integrate_tiles(const Workers& workers) {
  std::atomic<bool> valid = true;
  workers.for_each_with_worker(static_cast<int>(tile_begins.size()) - 1, [&](int i, int worker) {
    const auto tile = static_cast<std::size_t>(i);
    for (std::size_t k = tile_begins[tile]; k < tile_begins[tile + 1]; ++k) {
      const Tile& where = segments[k].tile;
      if (!advance(k, nullptr, {where.y, where.y + where.height}, worker)) valid = false;
    }
  });
  return valid;
}

bool EventCamera::State::integrate(const Workers& workers) {
  tile_begins.clear();
  int pixels_seen = 0;  // since the last tile_begins
  for (std::size_t i = 0; i < segments.size(); ++i) {
    if (segments[i].t0 == segments[i].t1) pixels.set_epoch(segments[i].t0);
    if (i == 0 || (segments[i].tile != segments[i - 1].tile && pixels_seen >= kPixelsPerPiece))
      tile_begins.push_back(i), pixels_seen = 0;
    pixels_seen += static_cast<int>(segments[i].tile.area());
  }
  tile_begins.push_back(segments.size());
  if (tile_begins.size() > 2 && !surround) return integrate_tiles(workers);
  for (std::size_t i = 0; i < segments.size(); ++i) {
    if (!integrate_one(i, workers)) return false;
  }
  return true;
}

void EventCamera::integrate(std::span<const Segment> segments, TimeNs watermark, const Workers& workers) {
  State& state = *state_;
  if (state.spoiled)
    throw UserError("event camera: an earlier irradiance was invalid, and the camera cannot go on; create a new one");
  const auto threads = static_cast<std::size_t>(workers.threads());
  if (state.updates.size() < threads)
    state.updates.resize(threads), state.events.resize(threads), state.buffers.resize(threads);
  TimeNs first = std::numeric_limits<TimeNs>::max(), last = std::numeric_limits<TimeNs>::min();
  for (const Segment& segment : segments) first = std::min(first, segment.t0), last = std::max(last, segment.t1);
  state.packing.origin = first;
  state.refuse_long_time(last - first);
  for (PackedEvents& events : state.events) events.set_packing(state.packing);
  if (state.circuit) segments = state.divide(segments);
  state.segments = segments;
  if (state.readout) state.readout->history.add(segments, state.pixels);
  if (state.circuit_readout) {
    state.circuit_readout->history.add(state.segments, state.size.width, state.size.height,
                                       state.circuit->front_values());
  }
  if (!state.integrate(workers)) {
    state.spoiled = true;
    for (const Segment& segment : segments) check_irradiance(segment);
  }
  state.queue.add(state.events, last);
  state.queue.sort_until(watermark, workers);
  PendingLabels* const labels = state.labels ? &*state.labels : nullptr;
  if (labels != nullptr) {
    for (PackedEvents& events : state.events) labels->add(events.labels);
    for (CircuitBuffer& buffer : state.buffers) labels->add(buffer.labels);
  }
  if (state.readout) state.readout->advance(state.pixels, state.updates[0], state.queue, watermark, labels);
  if (state.circuit_readout) {
    state.circuit_readout->advance(*state.circuit, state.queue, watermark, labels);
    state.lost += state.circuit_readout->take_lost();
  }
  for (CircuitBuffer& buffer : state.buffers) state.lost += std::exchange(buffer.lost, 0);
  state.watermark = watermark;
}

/// The events that leave the readout.
EventSpan EventCamera::State::read_out_until(TimeNs until) {
  if (!readout && !circuit_readout) return queue.release_until(until);
  from_readout.clear();
  if (readout) readout->release_until(until, from_readout);
  if (circuit_readout) circuit_readout->release_until(until, from_readout);
  return from_readout;
}

/// The events that pass the filters. Keeps their labels.
EventSpan EventCamera::State::filter(EventSpan unfiltered) {
  filtered.clear();
  filters->process(unfiltered, filtered);
  if (labels) keep_labels_of_passed(unfiltered, filtered, released_labels);
  return filtered;
}

EventSpan EventCamera::release_until(TimeNs until) {
  State& state = *state_;
  const EventSpan events = state.read_out_until(until);
  state.read_out += static_cast<std::int64_t>(events.size());
  if (state.labels) {
    state.released_labels.clear();
    state.labels->take(events, state.released_labels);
  }
  return state.filters ? state.filter(events) : events;
}

LabelSpan EventCamera::labels() const { return state_->released_labels; }

bool EventCamera::has_labels() const { return state_->labels.has_value(); }

TimeNs EventCamera::labels_from() const {
  return state_->labels ? std::min(state_->labels->earliest(), state_->watermark) : state_->watermark;
}

void EventCamera::process(const Image<float>& irradiance, TimeNs t, std::vector<Event>& out, const Workers& workers) {
  const State& state = *state_;
  if (irradiance.bounds() != state.size) {
    throw UserError("frame " + std::to_string(state.frames) + ": its size is " + std::to_string(irradiance.width()) +
                    " x " + std::to_string(irradiance.height()) + " px; it must be the camera's, " +
                    std::to_string(state.size.width) + " x " + std::to_string(state.size.height) + " px");
  }
  process(irradiance.pixels(), t, out, workers);
}

void EventCamera::process(std::span<const float> irradiance, TimeNs t, std::vector<Event>& out,
                          const Workers& workers) {
  State& state = *state_;
  const std::string frame = "frame " + std::to_string(state.frames);
  if (irradiance.size() != state.size.area()) {
    throw UserError(frame + ": it has " + std::to_string(irradiance.size()) + " pixels; it must have the camera's " +
                    std::to_string(state.size.area()) + " pixels");
  }
  const bool first = state.frames == 0;
  if (!first && t <= state.last_time) {
    throw UserError(frame + ": its time, " + std::to_string(t) +
                    " ns, does not come after that of the previous frame, " + std::to_string(state.last_time) +
                    " ns; pass the frames in order of time");
  }
  if (state.next_frame.empty()) state.next_frame = Image<float>(state.size.width, state.size.height);
  std::copy(irradiance.begin(), irradiance.end(), state.next_frame.data());
  const Image<float>& before = first ? state.next_frame : state.last_frame;
  const Segment segment{state.size, first ? t : state.last_time, t, &before, &state.next_frame};
  try {
    check_irradiance(segment);
    integrate(std::span(&segment, 1), t, workers);
  } catch (const UserError& error) {
    throw UserError(frame + ": " + error.what());
  }
  const EventSpan events = release_until(t);
  out.insert(out.end(), events.begin(), events.end());
  std::swap(state.last_frame, state.next_frame);
  state.last_time = t;
  ++state.frames;
}

EventCameraStatistics EventCamera::statistics() const {
  EventCameraStatistics statistics;
  statistics.in_flight = static_cast<std::int64_t>(state_->queue.size());
  const auto add = [&](const auto& readout) {
    statistics.delayed = readout.delayed();
    statistics.longest_delay = readout.longest_delay();
    statistics.in_flight += static_cast<std::int64_t>(readout.waiting());
  };
  if (state_->readout) {
    add(*state_->readout);
    statistics.dropped = state_->readout->dropped();
  }
  if (state_->circuit_readout) add(*state_->circuit_readout);
  statistics.lost = state_->lost;
  statistics.read_out = state_->read_out;
  if (state_->filters) statistics.filtered = state_->filters->dropped();
  return statistics;
}

std::vector<std::byte> EventCamera::state() const {
  std::vector<std::byte> bytes;
  StateWriter archive(bytes);
  State::transfer(archive, *state_);
  if (state_->readout) state_->readout->history.save(archive);
  if (state_->circuit_readout) state_->circuit_readout->history.save(archive);
  archive.list(state_->queue.waiting());
  if (state_->labels) archive.list(state_->labels->waiting());
  return bytes;
}

void EventCamera::restore(std::span<const std::byte> state) {
  StateReader archive(state);
  state_->last_frame = Image<float>(state_->size.width, state_->size.height);
  State::transfer(archive, *state_);
  if (state_->readout) state_->readout->history.restore(archive);
  if (state_->circuit_readout) state_->circuit_readout->history.restore(archive);
  std::vector<Event> waiting;
  archive.list(waiting);
  std::vector<PendingLabels::Waiting> labels;
  if (state_->labels) archive.list(labels);
  if (!archive.at_end() || (state_->labels && !state_->labels->restore(labels))) StateReader::fail();
  state_->queue.restore(waiting);
}

}  // namespace esim::inline event_camera
