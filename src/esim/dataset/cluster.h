#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "esim/dataset/produce.h"

namespace esim {

/// Which share of a dataset this process makes. `text` is "I/N", I from 0 on; "auto/N", where I is that of the task of
/// a Slurm array or of the pod of an indexed Kubernetes job (JOB_COMPLETION_INDEX); or empty: the task of a Slurm
/// array, where it is one, and everything otherwise. Throws UserError for anything else.
Share share_named(const std::string& text);

/// The processors that Slurm gives to each task, where it says so; 0: it does not.
int slurm_processors();

struct SlurmJob {
  std::uint32_t tasks = 1;
  std::filesystem::path folder{};  ///< of the dataset; logs go there, too
  std::filesystem::path working_folder{};
  std::vector<std::string> command{};  ///< what each task runs
  std::vector<std::string> options{};  ///< of sbatch, further ones: "--partition=long"
};

/// A batch script for sbatch: an array of tasks, each of which makes its share, and which begin again where they were
/// ended. Whichever is the last writes the manifest.
std::string slurm_script(const SlurmJob& job);

/// As one word of a shell.
std::string shell_quoted(const std::string& word);

}  // namespace esim
