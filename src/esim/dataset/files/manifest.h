#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "esim/dataset/files/dataset_folder.h"
#include "esim/dataset/generators/magnitudes.h"

namespace esim::inline dataset {

/// The existing part of a dataset.
struct DatasetState {
  std::vector<ShardRecord> shards{};     ///< complete ones, in order
  std::vector<std::uint32_t> missing{};  ///< numbers of the other shards
  std::uint64_t sequences = 0, events = 0, bytes = 0;
  bool complete() const { return missing.empty(); }
};

/// Reads the records without reading the files.
DatasetState survey_dataset(const DatasetFolder& folder);

/// Writes manifest.json, report.json and magnitudes.png of a complete dataset, unless another process is doing so.
void write_manifest(const DatasetFolder& folder, const DatasetState& state, const MagnitudeHistogram& magnitudes,
                    bool is_target);

/// Reads every file and compares it with its record, the records with the plan, and the manifest with both. Returns one
/// line per problem; empty if every sequence exists exactly once.
std::vector<std::string> check_dataset(const DatasetFolder& folder);

}  // namespace esim::inline dataset
