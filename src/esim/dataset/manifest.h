#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "esim/dataset/dataset_folder.h"
#include "esim/dataset/magnitudes.h"

namespace esim {

/// What there is of a dataset.
struct DatasetState {
  std::vector<ShardRecord> shards{};     ///< that are whole, in order
  std::vector<std::uint32_t> missing{};  ///< numbers of the others
  std::uint64_t sequences = 0, events = 0, bytes = 0;
  bool complete() const { return missing.empty(); }
};

/// Reads the records; what is in the files is not looked at.
DatasetState survey_dataset(const DatasetFolder& folder);

/// Writes manifest.json, report.json and magnitudes.png of a dataset that is whole, unless another process is doing it.
void write_manifest(const DatasetFolder& folder, const DatasetState& state, const MagnitudeHistogram& magnitudes,
                    bool is_target);

/// Reads every file, and holds it against its record, the records against the plan, and the manifest against both.
/// Returns what is wrong, a line for each; none: every sequence is there once.
std::vector<std::string> check_dataset(const DatasetFolder& folder);

}  // namespace esim
