#include "esim/dataset/files/dataset_folder.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <nlohmann/json.hpp>

#include "esim/core/error.h"
#include "esim/dataset/files/checksum.h"
#include "esim/files/folder_plan.h"
#include "esim/files/output_file.h"

namespace esim::inline dataset {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr int kFormatVersion = 1;
constexpr std::array<const char*, 2> kFormats{"hdf5", "webdataset"};
constexpr const char* kPlanName = "dataset.json";

std::string host_name() {
  std::array<char, 256> name{};
  return ::gethostname(name.data(), name.size() - 1) == 0 ? name.data() : "host";
}

Json to_json_value(const DatasetPlan& plan, const std::string& version) {
  return {{"esim", version},
          {"format_version", kFormatVersion},
          {"sequences", plan.count},
          {"shard_size", plan.shard_size},
          {"format", kFormats[static_cast<std::size_t>(plan.format)]},
          {"contents", names_of(plan.contents)},
          {"made_by", Json::parse(plan.maker)}};
}

DatasetPlan plan_in(const Json& json) {
  DatasetPlan plan;
  plan.count = json.at("sequences").get<std::uint32_t>();
  plan.shard_size = json.at("shard_size").get<std::uint32_t>();
  plan.format = json.at("format").get<std::string>() == kFormats[0] ? ShardFormat::hdf5 : ShardFormat::webdataset;
  plan.contents = contents_named(json.at("contents").get<std::vector<std::string>>());
  plan.maker = json.at("made_by").dump();
  if (plan.count < 1 || plan.shard_size < 1) throw UserError("it must have at least one sequence");
  return plan;
}

}  // namespace

std::uint32_t usual_shard_size(std::uint32_t count) {
  constexpr std::uint32_t kMax = 100, kFiles = 16;
  return std::clamp((count + kFiles - 1) / kFiles, 1U, kMax);
}

DatasetFolder::DatasetFolder(fs::path folder, const DatasetPlan& plan, const std::string& version)
    : folder_(std::move(folder)), plan_(plan), version_(version) {
  begin_or_continue(folder_, {"dataset", kPlanName, to_json_value(plan, version).dump()});
}

DatasetFolder::DatasetFolder(fs::path folder) : folder_(std::move(folder)) {
  const fs::path file = folder_ / kPlanName;
  const auto text = read_text(file);
  if (!text) throw UserError(fmt::format("{}: is not a dataset: {} is missing", folder_.string(), kPlanName));
  try {
    const Json json = Json::parse(*text);
    plan_ = plan_in(json);
    version_ = json.at("esim").get<std::string>();
  } catch (const std::exception&) {
    throw UserError(file.string() + ": is damaged, or from another version of esim");
  }
}

std::string DatasetFolder::shard_name(std::uint32_t shard) const {
  return fmt::format("shard-{:06}.{}", shard, plan_.format == ShardFormat::hdf5 ? "h5" : "tar");
}

fs::path DatasetFolder::record_path(std::uint32_t shard) const {
  return folder_ / fmt::format("shard-{:06}.json", shard);
}

std::optional<ShardRecord> DatasetFolder::record(std::uint32_t shard) const {
  const auto text = read_text(record_path(shard));
  if (!text) return std::nullopt;
  ShardRecord record;
  try {
    const Json json = Json::parse(*text);
    record.shard = json.at("shard").get<std::uint32_t>();
    record.first = json.at("first").get<std::uint32_t>();
    record.count = json.at("count").get<std::uint32_t>();
    record.file = json.at("file").get<std::string>();
    record.bytes = json.at("bytes").get<std::uint64_t>();
    record.crc32 = static_cast<std::uint32_t>(std::stoul(json.at("crc32").get<std::string>(), nullptr, 16));
    record.events = json.at("events").get<std::uint64_t>();
    record.magnitudes = json.at("magnitudes").get<std::vector<std::uint64_t>>();
    record.passed_over = json.at("passed_over").get<std::map<std::string, std::string>>();
  } catch (const std::exception&) {
    return std::nullopt;  // damaged: the shard is made again
  }
  std::error_code error;
  const bool whole = record.shard == shard && record.first == plan_.first_of(shard) &&
                     record.count == plan_.size_of(shard) && record.file == shard_name(shard) &&
                     fs::file_size(folder_ / record.file, error) == record.bytes && !error;
  return whole ? std::optional(record) : std::nullopt;
}

void DatasetFolder::write_record(const ShardRecord& record) const {
  const fs::path temporary = working_path(record.shard);
  OutputFile file(temporary);
  file.append(to_json(record) + "\n");
  file.close();
  std::error_code error;
  fs::rename(temporary, record_path(record.shard), error);
  if (error) throw_cannot_write(record_path(record.shard), error.message());
  sync_directory(folder_);
}

fs::path DatasetFolder::working_path(std::uint32_t shard) const {
  static std::atomic<unsigned> number = 0;
  return folder_ / fmt::format(".shard-{:06}.{}-{}-{}.tmp", shard, host_name(), ::getpid(), number++);
}

void DatasetFolder::remove_leftovers(std::uint32_t shard) const {
  const std::string prefix = fmt::format(".shard-{:06}.", shard);
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder_, error)) {
    std::error_code ignored;
    if (entry.path().filename().string().starts_with(prefix)) fs::remove(entry.path(), ignored);
  }
}

std::string to_json(const ShardRecord& record) {
  return Json{{"shard", record.shard},   {"first", record.first},           {"count", record.count},
              {"file", record.file},     {"bytes", record.bytes},           {"crc32", checksum_text(record.crc32)},
              {"events", record.events}, {"magnitudes", record.magnitudes}, {"passed_over", record.passed_over}}
      .dump();
}

}  // namespace esim::inline dataset
