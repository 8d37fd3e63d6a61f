#include "esim/dataset/files/manifest.h"

#include <fmt/format.h>

#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>

#include "esim/dataset/files/checksum.h"
#include "esim/dataset/files/preview.h"
#include "esim/files/folder_plan.h"
#include "esim/files/output_file.h"
#include "esim/preview/pictures.h"

namespace esim::inline dataset {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr const char* kManifestName = "manifest.json";
constexpr const char* kReportName = "report.json";

std::string manifest_text(const DatasetFolder& folder, const DatasetState& state) {
  Json shards = Json::array();
  for (const ShardRecord& record : state.shards) {
    shards.push_back({{"file", record.file},
                      {"first", record.first},
                      {"count", record.count},
                      {"events", record.events},
                      {"bytes", record.bytes},
                      {"crc32", checksum_text(record.crc32)}});
  }
  const Json manifest{{"esim", folder.version()},
                      {"sequences", state.sequences},
                      {"events", state.events},
                      {"bytes", state.bytes},
                      {"contents", names_of(folder.plan().contents)},
                      {"made_by", Json::parse(folder.plan().maker)},
                      {"shards", std::move(shards)}};
  return manifest.dump(1) + "\n";
}

/// The pixel counts of all shards by magnitude.
std::vector<std::uint64_t> magnitudes_of(const DatasetState& state) {
  std::vector<std::uint64_t> sum;
  for (const ShardRecord& record : state.shards) {
    sum.resize(std::max(sum.size(), record.magnitudes.size()));
    for (std::size_t i = 0; i < record.magnitudes.size(); ++i) sum[i] += record.magnitudes[i];
  }
  return sum;
}

std::string report_text(const DatasetState& state, const MagnitudeHistogram& bins, bool is_target,
                        const std::vector<std::uint64_t>& counts) {
  const std::vector<double> fractions = fractions_of(counts);
  Json magnitudes{{"edges_px", bins.edges}, {"fractions", fractions}};
  if (is_target) {
    magnitudes["target"] = bins.source;
    magnitudes["target_fractions"] = bins.fractions;
    magnitudes["total_variation"] = total_variation(fractions, bins.fractions);
  }
  std::map<std::string, std::string> passed_over;
  for (const ShardRecord& record : state.shards)
    passed_over.insert(record.passed_over.begin(), record.passed_over.end());
  return Json{{"sequences", state.sequences},
              {"events", state.events},
              {"events_per_sequence", static_cast<double>(state.events) / static_cast<double>(state.sequences)},
              {"optical_flow", std::move(magnitudes)},
              {"images_passed_over", passed_over.size()},
              {"passed_over", passed_over}}
             .dump(1) +
         "\n";
}

std::string text_of_file(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  return std::move(text).str();
}

/// The problem of a shard's content; empty if it is correct.
std::string problem_of(const fs::path& path, const ShardRecord& record) {
  const std::uint32_t checksum = checksum_of(path).crc32;
  if (checksum == record.crc32) return {};
  return fmt::format("{}: is damaged: its checksum is {}, not {}; remove it and make the dataset again to repair it",
                     path.string(), checksum_text(checksum), checksum_text(record.crc32));
}

}  // namespace

DatasetState survey_dataset(const DatasetFolder& folder) {
  DatasetState state;
  for (std::uint32_t shard = 0; shard < folder.plan().shards(); ++shard) {
    auto record = folder.record(shard);
    if (!record) {
      state.missing.push_back(shard);
      continue;
    }
    state.sequences += record->count;
    state.events += record->events;
    state.bytes += record->bytes;
    state.shards.push_back(std::move(*record));
  }
  return state;
}

void write_manifest(const DatasetFolder& folder, const DatasetState& state, const MagnitudeHistogram& magnitudes,
                    bool is_target) {
  // Several processes may arrive here at the same time; only one of them writes.
  const std::uint32_t beyond = folder.plan().shards();
  const FolderLock lock(folder.path(), beyond);
  if (!lock.owned()) return;
  folder.remove_leftovers(beyond);
  const std::vector<std::uint64_t> counts = magnitudes_of(state);
  const auto write = [&](const char* name, const std::string& text) {
    const fs::path working = folder.working_path(beyond);
    OutputFile file(working);
    file.append(text);
    file.close();
    std::error_code error;
    fs::rename(working, folder.path() / name, error);
    if (error) throw_cannot_write(folder.path() / name, error.message());
  };
  write(kMagnitudesName, encode_png(draw_magnitudes(magnitudes, is_target, counts)));
  write(kReportName, report_text(state, magnitudes, is_target, counts));
  write(kManifestName, manifest_text(folder, state));
  sync_directory(folder.path());
}

std::vector<std::string> check_dataset(const DatasetFolder& folder) {
  const DatasetState state = survey_dataset(folder);
  std::vector<std::string> problems;
  for (const std::uint32_t shard : state.missing) {
    problems.push_back(fmt::format("{}: sequences {} to {} are missing; run the command that makes the dataset again",
                                   (folder.path() / folder.shard_name(shard)).string(), folder.plan().first_of(shard),
                                   folder.plan().first_of(shard) + folder.plan().size_of(shard) - 1));
  }
  for (const ShardRecord& record : state.shards) {
    if (std::string problem = problem_of(folder.path() / record.file, record); !problem.empty())
      problems.push_back(std::move(problem));
  }
  const fs::path manifest = folder.path() / kManifestName;
  if (state.complete() && text_of_file(manifest) != manifest_text(folder, state)) {
    problems.push_back(manifest.string() +
                       ": is missing or does not match the files; run the command that makes the dataset again");
  }
  return problems;
}

}  // namespace esim::inline dataset
