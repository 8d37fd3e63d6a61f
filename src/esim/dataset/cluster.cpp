#include "esim/dataset/cluster.h"

#include <fmt/format.h>

#include <charconv>
#include <cstdlib>
#include <optional>

#include "esim/compose/provenance.h"
#include "esim/core/error.h"

namespace esim::inline dataset {
namespace {

std::optional<std::uint32_t> number(std::string_view text) {
  std::uint32_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size() && !text.empty() ? std::optional(value)
                                                                                   : std::nullopt;
}

/// A number in the environment.
std::optional<std::uint32_t> from_environment(const char* name) {
  const char* const text = std::getenv(name);
  return text != nullptr ? number(text) : std::nullopt;
}

/// The index of this task of a Slurm array or an indexed job, from 0.
std::optional<std::uint32_t> index_of_task() {
  if (const auto task = from_environment("SLURM_ARRAY_TASK_ID"))
    return *task - from_environment("SLURM_ARRAY_TASK_MIN").value_or(0);
  return from_environment("JOB_COMPLETION_INDEX");
}

}  // namespace

Share share_named(const std::string& text) {
  if (text.empty()) {
    const auto task = from_environment("SLURM_ARRAY_TASK_ID"), tasks = from_environment("SLURM_ARRAY_TASK_COUNT");
    if (!task || !tasks || *tasks < 1) return {};
    return {*index_of_task() % *tasks, *tasks};
  }
  const std::size_t slash = text.find('/');
  const std::string first = text.substr(0, slash);
  const auto part = first == "auto" ? index_of_task() : number(first);
  const auto parts = slash == std::string::npos ? std::nullopt : number(std::string_view(text).substr(slash + 1));
  if (first == "auto" && !part) {
    throw UserError(
        fmt::format("--shard {}: neither SLURM_ARRAY_TASK_ID nor JOB_COMPLETION_INDEX is set; give the "
                    "part, as in 0/8",
                    text));
  }
  if (!part || !parts || *part >= *parts)
    throw UserError(fmt::format("--shard {}: must be I/N with I from 0 to N - 1, as in 0/8, or auto/N", text));
  return {*part, *parts};
}

int slurm_processors() { return static_cast<int>(from_environment("SLURM_CPUS_PER_TASK").value_or(0)); }

std::string slurm_script(const SlurmJob& job) {
  std::string script = "#!/bin/bash\n";
  script += "#SBATCH --job-name=esim-dataset\n";
  script += fmt::format("#SBATCH --array=0-{}\n", job.tasks - 1);
  script += fmt::format("#SBATCH --chdir={}\n", job.working_folder.string());
  script += fmt::format("#SBATCH --output={}/slurm-%a.log\n", job.folder.string());
  script += "#SBATCH --open-mode=append\n#SBATCH --requeue\n";
  for (const std::string& option : job.options) script += fmt::format("#SBATCH {}\n", option);
  script += "\n# A task that is killed and requeued continues its work; the last task to finish writes the manifest.\n";
  script += "exec";
  for (const std::string& word : job.command) script += " " + shell_quoted(word);
  return script + fmt::format(" --shard auto/{}\n", job.tasks);
}

}  // namespace esim::inline dataset
