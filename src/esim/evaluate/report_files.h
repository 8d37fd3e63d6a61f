#pragma once

#include <filesystem>

#include "esim/evaluate/sampling_evaluation.h"

namespace esim {

/// Writes into a folder what people read of an evaluation: report.md, summary.csv, samples.csv and figures.
void write_report_files(const SamplingEvaluation& evaluation, const std::filesystem::path& folder);

}  // namespace esim
