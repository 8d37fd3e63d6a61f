#include "esim/recording/recording_directory.h"

#include <fcntl.h>
#include <stdio.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <system_error>
#include <utility>

#include "esim/core/error.h"
#include "esim/core/remedy.h"
#include "esim/files/input_file.h"
#include "esim/files/output_file.h"

namespace esim::inline recording {
namespace {

namespace fs = std::filesystem;

constexpr const char* kReport = "report.json";
constexpr const char* kRunning = "{\"status\": \"running\"}\n";

// "out/" and "./out" name the same directory as "out".
fs::path normalised(const fs::path& out) {
  fs::path path = out.lexically_normal();
  if (path.has_relative_path() && !path.has_filename()) path = path.parent_path();
  if (!path.has_filename() || path.filename() == "." || path.filename() == "..") {
    throw UserError("cannot record to \"" + out.string() + "\": give the path of a new directory");
  }
  return path;
}

// The final folder of a recording that may be given by the name that it has until then.
fs::path without_incomplete(const fs::path& out) {
  fs::path path = normalised(out);
  if (path.extension() == ".incomplete") path.replace_extension();
  return path;
}

// A run that was killed early left only the start of its report.
bool looks_like_a_recording(const fs::path& directory) {
  std::error_code error;
  return fs::exists(directory / kReport, error) || fs::exists(directory / "scenario.yaml", error) ||
         fs::exists(directory / (std::string(kReport) + kTemporaryExtension), error) || fs::is_empty(directory, error);
}

// Removes the report last: if this process is killed, the rest of the folder still looks like a recording.
void remove_recording(const fs::path& directory, std::error_code& error) {
  for (fs::directory_iterator entry(directory, error), end; !error && entry != end; entry.increment(error)) {
    std::error_code ignored;  // files that remain prevent the removal of the folder
    if (entry->path().filename() != kReport) fs::remove_all(entry->path(), ignored);
  }
  fs::remove_all(directory, error);
}

// Must be called before anything changes errno.
[[noreturn]] void throw_cannot_create(const fs::path& directory) {
  throw OutputError("cannot create the directory " + directory.string() + ": " + system_reason(errno) +
                    "; choose another folder for the output");
}

bool is_home(const fs::path& directory) {
  const char* home = std::getenv("HOME");
  std::error_code error;
  return home != nullptr && *home != '\0' && fs::equivalent(directory, home, error);
}

// Replacing deletes, so this requires a folder that certainly is a recording.
void require_replaceable(const fs::path& directory) {
  const auto refuse = [&](const std::string& why) {
    throw UserError(directory.string() + " " + why + " and is not replaced: choose another name");
  };
  std::error_code error;
  const fs::file_status status = fs::symlink_status(directory, error);
  if (fs::is_symlink(status)) refuse("is a symbolic link");
  if (!fs::is_directory(status)) refuse("is not a directory");
  if (is_home(directory)) refuse("is your home directory");
  if (!looks_like_a_recording(directory)) {
    refuse("does not look like a recording (no report.json or scenario.yaml inside)");
  }
}

int lock_directory(const fs::path& directory) {
  const int descriptor = ::open(directory.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor >= 0) ::flock(descriptor, LOCK_EX | LOCK_NB);
  return descriptor;
}

// Moves `from` to `to`, which must not exist, or exchanges the two. Some file systems cannot do either in one step.
bool rename_in_one_step(const fs::path& from, const fs::path& to, unsigned flag) {
  if (::renameat2(AT_FDCWD, from.c_str(), AT_FDCWD, to.c_str(), flag) == 0) return true;
  if (errno == EINVAL || errno == ENOSYS) return false;
  throw std::system_error(errno, std::generic_category());
}

// After an exchange, the old recording is in `working` and is removed there.
void replace_directory(const fs::path& working, const fs::path& out) {
  fs::path old = working;
  if (!rename_in_one_step(working, out, RENAME_EXCHANGE)) {
    old = out;
    old += ".replaced";
    fs::rename(out, old);
    fs::rename(working, out);
  }
  std::error_code error;
  remove_recording(old, error);
  if (error) throw std::system_error(error);
}

}  // namespace

fs::path incomplete_path(const fs::path& out) {
  fs::path path = out;
  path += ".incomplete";
  return path;
}

void require_existing(const fs::path& path) {
  std::error_code error, ignored;
  if (fs::exists(path, error)) return;
  std::string problem = path.string() + ": " + (error ? error.message() : "no such file or directory");
  const fs::path whole = path.has_filename() || !path.has_relative_path() ? path : path.parent_path();
  const fs::path incomplete = incomplete_path(whole);
  if (fs::exists(incomplete, ignored))
    problem += "; there is " + incomplete.string() + ", which is being written or was left unfinished";
  throw UserError(problem);
}

bool is_being_written(const fs::path& working_directory) {
  const int descriptor = ::open(working_directory.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0) return false;
  const bool locked = ::flock(descriptor, LOCK_SH | LOCK_NB) != 0 && errno == EWOULDBLOCK;
  ::close(descriptor);
  return locked;
}

RecordingDirectory::RecordingDirectory(const fs::path& out, bool force)
    : out_(normalised(out)), working_(incomplete_path(out_)) {
  // Check existing files.
  std::error_code error;
  const fs::file_status status = fs::symlink_status(out_, error);
  if (fs::exists(status)) {
    if (!fs::is_directory(status) && !fs::is_symlink(status)) {
      throw UserError(out_.string() + " is a file: choose another name");
    }
    if (!force) throw RemediableError(out_.string() + " exists already: choose another name", Remedy::replace_output);
    require_replaceable(out_);
    replace_ = true;
  } else if (status.type() == fs::file_type::none) {
    throw OutputError("cannot record to " + out_.string() + ": " + error.message());
  }

  try {
    create_parents();
    create_working_directory(force);
    write_file_atomically(working_ / kReport, kRunning);
  } catch (...) {
    discard();
    throw;
  }
}

RecordingDirectory::RecordingDirectory(fs::path out, fs::path working)
    : out_(std::move(out)), working_(std::move(working)), owned_(true), keep_(true), lock_(lock_directory(working_)) {
  std::error_code error;
  replace_ = fs::exists(out_, error);  // as it was begun
  if (replace_) require_replaceable(out_);
  write_file_atomically(working_ / kReport, kRunning);
}

fs::path RecordingDirectory::resumable(const fs::path& out) {
  const fs::path whole = without_incomplete(out), working = incomplete_path(whole);
  std::error_code error;
  if (fs::exists(working, error)) {
    if (is_being_written(working))
      throw UserError(working.string() + " is being written by another process: wait for its end, or stop it first");
    return working;
  }
  if (fs::is_directory(whole, error)) return whole;
  throw UserError("there is neither " + whole.string() + " nor " + working.string() + " to resume");
}

RecordingDirectory RecordingDirectory::resume(const fs::path& out) {
  const fs::path existing = resumable(out), whole = without_incomplete(out), working = incomplete_path(whole);
  std::error_code error;
  if (existing != working) fs::rename(existing, working, error);
  if (error)
    throw OutputError("cannot rename " + existing.string() + " to " + working.string() + ": " + error.message());
  return {whole, working};
}

void RecordingDirectory::create_parents() {
  // Starts with the outermost missing folder, so that created folders can be removed after an error.
  std::vector<fs::path> missing;
  std::error_code error;
  for (fs::path parent = out_.parent_path(); !parent.empty() && !fs::exists(parent, error);
       parent = parent.parent_path()) {
    missing.push_back(parent);
  }
  for (auto parent = missing.rbegin(); parent != missing.rend(); ++parent) {
    if (::mkdir(parent->c_str(), 0777) == 0) {
      created_parents_.push_back(*parent);
    } else if (errno != EEXIST) {
      throw_cannot_create(*parent);
    }
  }
}

void RecordingDirectory::create_working_directory(bool force) {
  std::error_code error;
  if (fs::exists(fs::symlink_status(working_, error))) {
    if (is_being_written(working_)) {
      throw UserError(working_.string() + " is being written by another process: choose another name");
    }
    if (!force) {
      throw RemediableError(
          working_.string() + " is left from a run that was killed: inspect it, resume it, or choose another name",
          Remedy::replace_output);
    }
    require_replaceable(working_);
    remove_recording(working_, error);
    if (error) throw OutputError("cannot remove " + working_.string() + ": " + error.message());
  }
  if (::mkdir(working_.c_str(), 0777) != 0) {
    throw_cannot_create(working_);
  }
  owned_ = true;
  lock_ = lock_directory(working_);
}

RecordingDirectory::~RecordingDirectory() { discard(); }

void RecordingDirectory::discard() noexcept {
  if (!keep_) {
    std::error_code error;
    if (owned_) remove_recording(working_, error);
    for (auto parent = created_parents_.rbegin(); parent != created_parents_.rend(); ++parent) {
      ::rmdir(parent->c_str());  // remains if another program uses it meanwhile
    }
    created_parents_.clear();
  }
  if (lock_ >= 0) ::close(std::exchange(lock_, -1));
}

void RecordingDirectory::finish(std::string_view report_json) {
  keep_ = true;
  write_file_atomically(working_ / kReport, report_json);
  sync_directory(working_);
  try {
    if (replace_) {
      replace_directory(working_, out_);
    } else if (!rename_in_one_step(working_, out_, RENAME_NOREPLACE)) {
      fs::rename(working_, out_);
    }
  } catch (const std::system_error& failure) {
    throw OutputError("cannot rename " + working_.string() + " to " + out_.string() + ": " + failure.code().message() +
                      "; the recording is kept in the former");
  }
  sync_directory(out_.parent_path().empty() ? fs::path(".") : out_.parent_path());
}

void RecordingDirectory::keep(std::string_view reason) noexcept {
  keep_ = true;
  if (reason.empty()) return;
  try {
    const nlohmann::ordered_json report = {{"status", "interrupted"}, {"reason", reason}};
    write_file_atomically(working_ / kReport,
                          report.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n");
  } catch (const std::exception&) {  // no room: the report still says "running"
  }
}

std::optional<fs::path> events_file_in(const fs::path& folder) {
  std::error_code error;
  for (const char* name : {"events.h5", "events.txt"}) {
    if (fs::is_regular_file(folder / name, error)) return folder / name;
  }
  return std::nullopt;
}

bool has_begun(const fs::path& file) {
  constexpr std::size_t kSignatureBytes = 8;
  std::error_code error;
  return fs::is_regular_file(file, error) &&
         read_head(file, kSignatureBytes).find_first_not_of('\0') != std::string::npos;
}

bool has_conversion_report(const fs::path& folder) {
  constexpr std::streamsize kMaxBytes = 1 << 16;
  std::ifstream file(folder / "report.json", std::ios::binary);
  std::string text(static_cast<std::size_t>(kMaxBytes), '\0');
  file.read(text.data(), kMaxBytes);
  text.resize(static_cast<std::size_t>(file.gcount()));
  return text.find("\"converted_from\"") != std::string::npos;
}

}  // namespace esim::inline recording
