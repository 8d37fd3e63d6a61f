#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "esim/core/error.h"
#include "esim/core/image.h"
#include "esim/core/state_archive.h"
#include "esim/core/time.h"
#include "esim/render/renderer.h"
#include "esim/sampling/measured_error.h"

namespace esim::inline sampling {

/// Pixels to evaluate at one time.
struct TilesAt {
  TimeNs t = 0;
  std::vector<Tile> tiles;
};

/// Which pixels to evaluate at which time.
struct SampleRequest {
  TimeNs t = 0;
  std::vector<Tile> tiles;
  Renderer* renderer = nullptr;  ///< renders this request: the sampler's own; null: the renderer of the camera
  int motion_rows = 1;           ///< V is needed in every motion_rows-th row, from the image's first on
  std::vector<TilesAt> later{};  ///< other tiles that go into the same sample, in order of time

  TimeNs last() const { return later.empty() ? t : later.back().t; }
};

/// A result that only one method has, under its name in report.json.
struct NamedResult {
  std::string name;
  std::variant<std::int64_t, double, MeasuredError> value;
};

/// The sampler's decisions so far, for the report.
struct SamplingStatistics {
  std::int64_t samples = 0;            ///< requests answered
  std::int64_t pixel_evaluations = 0;  ///< pixels in them
  std::int64_t held_to_max_rate = 0;   ///< intervals that would have been shorter without max_rate_hz

  // Only methods that measure their error:
  std::optional<MeasuredError> measured_error;
  double tolerance = 0;         ///< required, in contrast thresholds
  std::int64_t bisections = 0;  ///< samples taken because the predicted error was too large
  std::int64_t audits = 0;      ///< samples taken only to measure the error

  std::vector<NamedResult> others;
};

/// Decides which pixels of one camera are evaluated at which times, and converts the samples into segments. A sampler
/// requests renderings and does not start them. Use: while next() returns a request, render it, pass the sample to
/// accept(), and call more() until it returns nothing.
class Sampler {
 public:
  virtual ~Sampler() = default;

  /// The next evaluation, the same until accept() is called. Null after the last one, and while more() must be called
  /// first.
  virtual const SampleRequest* next() const = 0;

  /// Takes the evaluation that next() requested. Returns the segments that it completes, valid until the next call;
  /// none if another evaluation is needed first. The segments of a tile are contiguous and in order of time. The
  /// sample's buffers are exchanged for used ones.
  virtual std::span<const Segment> accept(Sample& sample) = 0;

  /// Further segments that the same evaluation completes, a few at a time and valid until the next call; empty after
  /// the last ones. Must be called until it is empty.
  virtual std::span<const Segment> more() = 0;

  /// No future segment begins before this time. It never decreases, and is the span's end after the last sample.
  virtual TimeNs watermark() const = 0;

  virtual SamplingStatistics statistics() const = 0;

  /// Saves the state for restore() of a sampler that was made with the same arguments, which then requests the same
  /// evaluations. Not while more() must be called. Throws InternalError if the sampler does not support it.
  virtual void save(StateWriter&) const { throw InternalError("sampling: this sampler cannot save its state"); }
  virtual void restore(StateReader&) { throw InternalError("sampling: this sampler cannot restore a state"); }
};

/// The statistics, except `others`, for core/state_archive.h.
template <class Archive, class Statistics>
void transfer_statistics(Archive& archive, Statistics& statistics) {
  archive.value(statistics.samples);
  archive.value(statistics.pixel_evaluations);
  archive.value(statistics.held_to_max_rate);
  archive.value(statistics.measured_error);
  archive.value(statistics.tolerance);
  archive.value(statistics.bisections);
  archive.value(statistics.audits);
}

}  // namespace esim::inline sampling
