#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <vector>

#include "esim/core/image.h"
#include "esim/core/parallel.h"
#include "esim/core/time.h"
#include "esim/render/sample.h"

namespace esim::inline sample_store {

/// How irradiance is stored.
enum class SamplePrecision {
  exact,    ///< all bits
  rounded,  ///< to kRoundedBits bits of the mantissa
};

/// Bits of the mantissa that rounding keeps, so that the brightness ln(E + eps) changes by at most kMaxRoundingError.
inline constexpr int kRoundedBits = 10;
inline constexpr double kMaxRoundingError = 1.0 / (2 << kRoundedBits);

/// Properties of a store.
struct SampleStoreInfo {
  int width = 0, height = 0;  ///< px
  TimeNs start = 0, end = 0;  ///< of the simulation
  SamplePrecision precision = SamplePrecision::exact;
};

/// Writes the segments that the event sensors of a camera see to a file (docs/methods/samples.md).
class SampleStoreWriter {
 public:
  /// Throws OutputError if the file cannot be written, as all functions do.
  SampleStoreWriter(const std::filesystem::path& file, const SampleStoreInfo& info);

  /// Continues a file from a state(): what was written later is dropped. Throws UserError if the state is of another
  /// store.
  SampleStoreWriter(const std::filesystem::path& file, const SampleStoreInfo& info, std::span<const std::byte> state);
  ~SampleStoreWriter();
  SampleStoreWriter(SampleStoreWriter&&) noexcept;
  SampleStoreWriter& operator=(SampleStoreWriter&&) noexcept;

  /// Adds segments in the order of EventCamera::integrate(), with its watermark.
  void add(std::span<const Segment> segments, TimeNs watermark, const Workers& workers);

  /// What is needed to continue after the segments so far, which are on the disk when it returns.
  std::vector<std::byte> state();

  /// Completes the file. Without it, the file ends with what has been written.
  void finish(const Workers& workers);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Reads such a file.
class SampleStoreReader {
 public:
  /// `read_ahead`: a thread of its own reads what comes next while the last portions are in use. Throws UserError if
  /// the file is not a store, or one of another version.
  explicit SampleStoreReader(const std::filesystem::path& file, bool read_ahead = false);
  ~SampleStoreReader();
  SampleStoreReader(SampleStoreReader&&) noexcept;
  SampleStoreReader& operator=(SampleStoreReader&&) noexcept;

  const SampleStoreInfo& info() const;

  /// Before the first next(): begins where reading can, at the last watermark that is at most `t` (ns). The first
  /// segments of the tiles are then not instants, and begin at different times, since tiles are ahead of the watermark.
  /// Throws UserError if the store is damaged or incomplete.
  void seek(TimeNs t);

  /// The segments of the next add(), valid until the next call unless has_more(), and its watermark.
  struct Portion {
    std::span<const Segment> segments;
    TimeNs watermark = 0;
  };

  /// Null after the last one. Throws UserError (which file, at which byte, what is wrong) if the file is damaged, or if
  /// it ends before it was completed.
  const Portion* next(const Workers& workers);

  /// Whether the next portion has been read together with the last one, which then stays valid.
  bool has_more() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace esim::inline sample_store
