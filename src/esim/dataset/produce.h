#pragma once

#include <cstdint>
#include <functional>

#include "esim/dataset/dataset_folder.h"
#include "esim/dataset/sequence_maker.h"

namespace esim {

/// Who of several does what: part `part` of `parts` makes the shards whose numbers leave that remainder.
struct Share {
  std::uint32_t part = 0, parts = 1;
};

struct ProductionProgress {
  std::uint32_t done = 0, all = 0;  ///< sequences of this share
  std::uint32_t made = 0;           ///< of them in this run
  std::uint64_t events = 0;         ///< in what was made
};

/// Called from one thread at a time, often; false ends the production: shards that are not finished are lost.
using ProductionMonitor = std::function<bool(const ProductionProgress&)>;

struct Production {
  ProductionProgress progress{};
  std::uint32_t elsewhere = 0;  ///< shards of this share that another process is writing
  bool complete() const { return progress.done == progress.all; }
};

/// Makes the shards of a share that are missing, on `threads` threads, each a shard at a time. What is on disk then
/// does not depend on how many threads and processes there are, nor on how often they were ended. Throws UserError,
/// after the shards that are being written were given up; those that were finished are kept.
Production produce(const DatasetFolder& folder, const SequenceMaker& maker, const Share& share, int threads,
                   const ProductionMonitor& monitor);

}  // namespace esim
