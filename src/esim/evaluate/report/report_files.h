#pragma once

#include <filesystem>

#include "esim/evaluate/sampling_evaluation.h"

namespace esim::inline evaluate {

/// Writes report.md, summary.csv, samples.csv and the figures of an evaluation into a folder.
void write_report_files(const SamplingEvaluation& evaluation, const std::filesystem::path& folder);

}  // namespace esim::inline evaluate
