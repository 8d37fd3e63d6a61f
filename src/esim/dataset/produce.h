#pragma once

#include <cstdint>
#include <functional>

#include "esim/dataset/files/dataset_folder.h"
#include "esim/dataset/sequence_maker.h"

namespace esim::inline dataset {

/// The part of this process: it makes the shards whose numbers are `part` modulo `parts`.
struct Share {
  std::uint32_t part = 0, parts = 1;
};

struct ProductionProgress {
  std::uint32_t done = 0, all = 0;  ///< sequences of this part
  std::uint32_t made = 0;           ///< sequences made in this run
  std::uint64_t events = 0;         ///< of the sequences made
};

/// Called often, from one thread at a time. Returning false ends the production; unfinished shards are lost.
using ProductionMonitor = std::function<bool(const ProductionProgress&)>;

struct Production {
  ProductionProgress progress{};
  std::uint32_t elsewhere = 0;  ///< shards of this part that another process is writing
  bool complete() const { return progress.done == progress.all; }
};

/// Makes the missing shards of a part on `threads` threads, one shard per thread at a time. The files do not depend on
/// the number of threads and processes, nor on interruptions. On UserError, unfinished shards are removed and finished
/// ones are kept.
Production produce(const DatasetFolder& folder, const SequenceMaker& maker, const Share& share, int threads,
                   const ProductionMonitor& monitor);

}  // namespace esim::inline dataset
