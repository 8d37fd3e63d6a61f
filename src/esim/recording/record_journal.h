#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "esim/files/output_file.h"
#include "esim/recording/record.h"

namespace esim::inline recording {

/// Keeps the records of a simulation in a file while it passes them on, so that another process can make the same
/// outputs again up to a checkpoint, and continue. Only the same build of esim can read the file.
class RecordJournal final : public Sink {
 public:
  /// Creates the file.
  RecordJournal(std::filesystem::path file, std::unique_ptr<Sink> out);

  /// Continues a file whose first bytes, checkpoint() of another process, are valid; removes the rest. begin() passes
  /// these records on. Throws UserError if they are not there.
  RecordJournal(std::filesystem::path file, std::uint64_t valid_bytes, std::unique_ptr<Sink> out);

  void begin(const RecordingInfo& info) override;
  void write(const Record& record) override;
  void end(bool complete) override;

  /// Makes the records so far durable. Returns the size of the file.
  std::uint64_t checkpoint();

 private:
  void replay();
  void write_block();
  [[noreturn]] void damaged() const;

  std::filesystem::path path_;
  std::uint64_t to_replay_ = 0;
  std::optional<OutputFile> file_;  // open from begin() on, or at once if it is new
  std::vector<std::byte> records_;  // not in the file yet
  std::string frame_;
  std::unique_ptr<Sink> out_;
};

}  // namespace esim::inline recording
