#include "esim/files/folder_plan.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "esim/core/error.h"
#include "esim/files/output_file.h"

namespace esim::inline files {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr const char* kLockName = ".lock";
constexpr std::uint64_t kPlanPart = std::uint64_t{1} << 40;  // beyond the parts of the results

/// Whether the folder is empty except for files of results that have just been begun.
bool holds_nothing(const fs::path& folder, const std::string& plan) {
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, error)) {
    const std::string name = entry.path().filename().string();
    if (name != kLockName && !name.starts_with(plan)) return false;
  }
  return !error;
}

Json parse_plan(const fs::path& file, const std::string& text) {
  Json json = Json::parse(text, nullptr, false);
  if (json.is_discarded() || !json.is_object())
    throw UserError(file.string() + ": is damaged; restore it, or write to another folder");
  return json;
}

/// The first difference of two plans: "seed is 1 there, but 2 here".
std::string difference(const Json& there, const Json& here, const std::string& within = "") {
  const auto member = [](const Json& object, const std::string& key) {
    const auto found = object.find(key);
    return found == object.end() ? Json() : *found;
  };
  Json keys = here;
  for (const auto& [key, value] : there.items()) keys.emplace(key, Json(value));
  for (const auto& [key, any] : keys.items()) {
    const Json before = member(there, key), now = member(here, key);
    if (before == now) continue;
    if (before.is_object() && now.is_object()) return difference(before, now, within + key + ".");
    constexpr std::size_t kMax = 60;
    const std::string was = before.is_null() ? "missing" : before.dump(), is = now.is_null() ? "missing" : now.dump();
    return std::max(was.size(), is.size()) > kMax ? fmt::format("{}{} differs", within, key)
                                                  : fmt::format("{}{} is {} there, but {} here", within, key, was, is);
  }
  return "the order differs";
}

}  // namespace

void begin_or_continue(const fs::path& folder, const FolderPlan& plan) {
  const fs::path file = folder / plan.file;
  const Json here = Json::parse(plan.json);
  std::error_code error;
  if (!fs::exists(file, error)) {
    if (fs::exists(folder, error) && (!fs::is_directory(folder, error) || !holds_nothing(folder, plan.file))) {
      throw UserError(fmt::format("{}: must be a {} or an empty folder; choose another folder, or empty it",
                                  folder.string(), plan.kind));
    }
    create_folder(folder);
    const FolderLock lock(folder, kPlanPart, true);
    if (!fs::exists(file, error)) write_file_atomically(file, here.dump(1) + "\n");
    sync_directory(folder);
  }
  const Json there = parse_plan(file, read_text(file).value_or(""));
  if (there == here) return;
  if (const std::string version = here.value("esim", ""); there.value("esim", "") != version) {
    throw UserError(
        fmt::format("{}: begun by esim {}, but this is esim {}; finish it with that version, or choose another "
                    "folder",
                    folder.string(), there.value("esim", "of an unknown version"), version));
  }
  throw UserError(
      fmt::format("{}: contains a different {}: {}; give the same options to continue it, or choose another folder",
                  folder.string(), plan.kind, difference(there, here)));
}

FolderLock::FolderLock(const fs::path& folder, std::uint64_t part, bool wait) {
  const fs::path file = folder / kLockName;
  const int descriptor = ::open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
  if (descriptor < 0) throw_cannot_write(file, system_reason(errno));
  struct flock range {};
  range.l_type = F_WRLCK;
  range.l_whence = SEEK_SET;
  range.l_start = static_cast<off_t>(part);
  range.l_len = 1;
  if (::fcntl(descriptor, wait ? F_OFD_SETLKW : F_OFD_SETLK, &range) == 0) {
    descriptor_ = descriptor;
    return;
  }
  const int error = errno;
  ::close(descriptor);
  if (error != EAGAIN && error != EACCES) throw_cannot_write(file, "cannot lock it: " + system_reason(error));
}

FolderLock::~FolderLock() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

std::optional<std::string> read_text(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream) return std::nullopt;
  std::ostringstream text;
  text << stream.rdbuf();
  return std::move(text).str();
}

}  // namespace esim::inline files
