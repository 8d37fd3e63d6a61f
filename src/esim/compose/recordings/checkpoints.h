#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "esim/compose/provenance.h"
#include "esim/core/inputs/used_files.h"
#include "esim/recording/record_journal.h"

// Private to compose.
namespace esim::inline compose {

/// The state of an incomplete simulation, in the folder of its recording: checkpoint/state, next to the journal of its
/// records.
struct Checkpoint {
  std::uint64_t journal_bytes = 0;  ///< of the journal, which belong to it
  std::vector<std::byte> state{};
  std::vector<std::vector<std::byte>> samples{};  ///< of SampleStores::state()

  // How the simulation began, for its report.
  Repetition repetition{};
  std::filesystem::path working_folder{};
  std::vector<UsedFile> scenario_files{};

  std::vector<UsedFile> inputs{};  ///< other files that the simulation has read
};

/// The folder of a recording's checkpoint.
std::filesystem::path checkpoint_folder(const std::filesystem::path& recording);
std::filesystem::path journal_file(const std::filesystem::path& recording);

/// Reads the latest checkpoint. Throws UserError if it does not exist, is damaged, or if another build of esim wrote
/// it.
Checkpoint read_checkpoint(const std::filesystem::path& recording);

/// Throws UserError, naming the file, if an input has changed since the checkpoint.
void require_unchanged(const Checkpoint& checkpoint, const std::vector<UsedFile>& inputs);

/// Throws UserError with the first difference if a simulation to be resumed has another scenario.
void require_same_scenario(const std::string& recorded, const std::string& given);

/// Writes checkpoints: often enough to lose little, seldom enough to cost little.
class CheckpointWriter {
 public:
  /// `origin`: of the simulation.
  CheckpointWriter(std::filesystem::path recording, RecordJournal& journal, Checkpoint origin);

  /// Whether it is time for the next one: 1 s after the previous one, more in longer simulations (2 % of the time so
  /// far, up to a minute) and if writing it takes longer than 2 % of that.
  bool due() const;

  /// `samples`: of SampleStores::state().
  void save(std::vector<std::byte> state, std::vector<std::vector<std::byte>> samples);

 private:
  using Clock = std::chrono::steady_clock;

  std::filesystem::path recording_;
  RecordJournal& journal_;
  Checkpoint checkpoint_;
  Clock::time_point began_ = Clock::now(), last_ = began_;
  Clock::duration cost_{};  // of the last one
};

}  // namespace esim::inline compose
