#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "esim/core/image.h"
#include "esim/core/time.h"
#include "esim/render/sample.h"
#include "esim/sampling/measured_error.h"

namespace esim {

/// Pixels at a time.
struct TilesAt {
  TimeNs t = 0;
  std::vector<Tile> tiles;
};

/// Which pixels to evaluate at which time.
struct SampleRequest {
  TimeNs t = 0;
  std::vector<Tile> tiles;
  bool of_sensor = false;  ///< by the sensor's own camera, where the sampler otherwise asks another (sampled_camera)
  int motion_rows = 1;     ///< V is wanted of one row in so many, from the image's first on
  std::vector<TilesAt> later{};  ///< other tiles that go into the same sample, in order of time

  TimeNs last() const { return later.empty() ? t : later.back().t; }
};

/// What a sampler has decided so far, for the report.
struct SamplingStatistics {
  std::int64_t samples = 0;            ///< requests answered
  std::int64_t pixel_evaluations = 0;  ///< pixels in them
  std::int64_t held_to_max_rate = 0;   ///< intervals that the criterion wanted shorter than 1 / max_rate_hz

  // Of schemes that measure their error.
  std::optional<MeasuredError> measured_error;
  double tolerance = 0;                           ///< that was asked for, in contrast thresholds
  std::int64_t bisections = 0;                    ///< samples taken because their neighbours disagreed
  std::int64_t audits = 0;                        ///< samples taken only to measure the error
  std::int64_t reconstructions = 0;               ///< images made between samples
  double unseen_share = 0;                        ///< of the reconstructed pixels: seen by no sample
  int supersampling = 1;                          ///< pixels of a sample to one of the sensor's, along each side
  std::optional<MeasuredError> resampling_floor;  ///< of the brightness: what no number of samples gets below
};

/// Decides when which pixels of one camera are evaluated, and turns the samples into segments. A sampler never
/// renders. Use: while next() gives a request, render it, pass the sample to accept(), and ask for more() until there
/// is none.
class Sampler {
 public:
  virtual ~Sampler() = default;

  /// The next evaluation wanted, the same until accept() is called. Null after the last one, and while more() has to
  /// be asked before it is known.
  virtual const SampleRequest* next() const = 0;

  /// Takes the evaluation that next() asked for. Returns the segments that are now known: those of a tile one after the
  /// other, contiguous, in order of time, and valid until the next call; none where it needs another evaluation first.
  /// The sample's buffers are exchanged for used ones.
  virtual std::span<const Segment> accept(Sample& sample) = 0;

  /// Further segments that the same evaluation has made known, a few at a time, likewise valid until the next call;
  /// none after the last ones. To be asked until then.
  virtual std::span<const Segment> more() = 0;

  /// No segment that is still to come begins before this time. Never decreases; the end after the last sample.
  virtual TimeNs watermark() const = 0;

  virtual SamplingStatistics statistics() const = 0;
};

}  // namespace esim
