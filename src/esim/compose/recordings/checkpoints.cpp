#include "esim/compose/recordings/checkpoints.h"

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <utility>

#include "esim/compose/compose.h"
#include "esim/core/error.h"
#include "esim/core/state_archive.h"
#include "esim/files/codecs/zstandard.h"
#include "esim/files/folder_plan.h"
#include "esim/files/output_file.h"

namespace esim::inline compose {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kSignature = "esim checkpoint\n";

fs::path state_file(const fs::path& recording) { return checkpoint_folder(recording) / "state"; }

void transfer(StateWriter& archive, const fs::path& path) { archive.text(path.string()); }
void transfer(StateReader& archive, fs::path& path) {
  std::string text;
  archive.text(text);
  path = text;
}

template <class Archive, class Files>
void transfer_files(Archive& archive, Files& files) {
  archive.objects(files, [](auto& a, auto& used) {
    transfer(a, used.path);
    a.value(used.regular);
    a.value(used.bytes);
    a.value(used.changed_ns);
    a.text(used.sha256);
  });
}

template <class Archive, class ACheckpoint>
void transfer_checkpoint(Archive& archive, ACheckpoint& checkpoint) {
  archive.value(checkpoint.journal_bytes);
  archive.list(checkpoint.state);
  archive.objects(checkpoint.samples, [](auto& a, auto& store) { a.list(store); });
  archive.text(checkpoint.repetition.command);
  archive.text(checkpoint.repetition.obstacle);
  transfer(archive, checkpoint.working_folder);
  transfer_files(archive, checkpoint.scenario_files);
  transfer_files(archive, checkpoint.inputs);
}

bool is_complete(const fs::path& recording) {
  std::ifstream stream(recording / "report.json");
  const nlohmann::json report = nlohmann::json::parse(stream, nullptr, false);
  return report.is_object() && report.value("status", "") == "complete";
}

std::string build() { return std::string(ESIM_VERSION) + " " + std::string(source_commit()); }

}  // namespace

fs::path checkpoint_folder(const fs::path& recording) { return recording / "checkpoint"; }
fs::path journal_file(const fs::path& recording) { return checkpoint_folder(recording) / "journal"; }

bool can_be_resumed(const fs::path& recording) {
  std::error_code error;
  return fs::is_regular_file(state_file(recording), error);
}

Checkpoint read_checkpoint(const fs::path& recording) {
  const fs::path file = state_file(recording);
  if (!can_be_resumed(recording)) {
    if (is_complete(recording)) throw UserError(recording.string() + " is complete: there is nothing to resume");
    throw UserError(recording.string() +
                    " cannot be resumed: it has no checkpoint; the first one is written after a few seconds. Simulate "
                    "the scenario again");
  }
  const std::string all = read_text(file).value_or("");
  if (!all.starts_with(kSignature))
    throw UserError(file.string() + " is not a checkpoint of a simulation; simulate the scenario again");
  const std::string_view frame = std::string_view(all).substr(kSignature.size());
  std::string bytes(zstandard_content_size(frame), '\0');
  if (bytes.empty() || !decompress_zstandard(frame, bytes)) {
    throw UserError(file.string() + " is damaged, and the simulation cannot be resumed; simulate the scenario again");
  }
  StateReader archive(std::as_bytes(std::span(bytes)));
  std::string writer;
  archive.text(writer);
  if (writer != build()) {
    throw UserError(recording.string() + " cannot be resumed: its checkpoint is of another build of esim, " + writer +
                    " (this is " + build() + "); resume it with that one, or simulate the scenario again");
  }
  Checkpoint checkpoint;
  transfer_checkpoint(archive, checkpoint);
  return checkpoint;
}

void require_unchanged(const Checkpoint& checkpoint, const std::vector<UsedFile>& inputs) {
  for (const UsedFile& before : checkpoint.inputs) {
    const auto now = std::ranges::find(inputs, before.path, &UsedFile::path);
    if (now != inputs.end() && now->bytes == before.bytes && now->changed_ns == before.changed_ns) continue;
    if (now != inputs.end() && !before.regular) continue;
    throw UserError(before.path.string() +
                    " has been changed since the simulation began, which can therefore not be resumed: restore the "
                    "file, or simulate the scenario again");
  }
}

void require_same_scenario(const std::string& recorded, const std::string& given) {
  if (recorded == given) return;
  std::istringstream before(recorded), now(given);
  std::string a, b;
  const auto next = [](std::istringstream& lines, std::string& line) {
    if (!std::getline(lines, line)) line.clear();
    line.erase(0, line.find_first_not_of(" -"));
  };
  do {
    next(before, a);
    next(now, b);
  } while (a == b && (before || now));
  const auto quoted = [](const std::string& line) { return line.empty() ? "nothing" : "\"" + line + "\""; };
  throw UserError("the simulation to resume has other options: " + quoted(a) + ", now " + quoted(b) +
                  "; resume it without changes, or simulate into another folder");
}

CheckpointWriter::CheckpointWriter(fs::path recording, RecordJournal& journal, Checkpoint origin)
    : recording_(std::move(recording)), journal_(journal), checkpoint_(std::move(origin)) {}

bool CheckpointWriter::due() const {
  constexpr std::chrono::seconds kShortest{1}, kLongest{60};
  const Clock::time_point now = Clock::now();
  const Clock::duration share = std::clamp<Clock::duration>((now - began_) / 50, kShortest, kLongest);
  return now - last_ >= std::max(share, 50 * cost_);
}

void CheckpointWriter::save(std::vector<std::byte> state, std::vector<std::vector<std::byte>> samples) {
  constexpr int kLevel = -10;  // of Zstandard
  const Clock::time_point before = Clock::now();
  checkpoint_.journal_bytes = journal_.checkpoint();
  checkpoint_.state = std::move(state);
  checkpoint_.samples = std::move(samples);
  std::vector<std::byte> bytes;
  StateWriter archive(bytes);
  archive.text(build());
  transfer_checkpoint(archive, std::as_const(checkpoint_));
  std::string frame;
  compress_zstandard({reinterpret_cast<const char*>(bytes.data()), bytes.size()}, kLevel, frame);
  write_file_atomically(state_file(recording_), std::string(kSignature) + frame);
  last_ = Clock::now();
  cost_ = last_ - before;
}

}  // namespace esim::inline compose
