#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "esim/dataset/produce.h"

namespace esim::inline dataset {

/// The part of a dataset that this process makes. `text` is "I/N" with I from 0; "auto/N" with I from the task of a
/// Slurm array or the pod of an indexed Kubernetes job (JOB_COMPLETION_INDEX); or empty: the task of a Slurm array if
/// there is one, otherwise everything. Throws UserError for any other text.
Share share_named(const std::string& text);

/// The processors that Slurm gives to each task; 0: unknown.
int slurm_processors();

struct SlurmJob {
  std::uint32_t tasks = 1;
  std::filesystem::path folder{};  ///< of the dataset and of the logs
  std::filesystem::path working_folder{};
  std::vector<std::string> command{};  ///< that each task runs
  std::vector<std::string> options{};  ///< additional options of sbatch: "--partition=long"
};

/// A batch script for sbatch: an array of tasks, each of which makes its part and continues after an interruption. The
/// last task to finish writes the manifest.
std::string slurm_script(const SlurmJob& job);

}  // namespace esim::inline dataset
