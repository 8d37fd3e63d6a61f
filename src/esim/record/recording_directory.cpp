#include "esim/record/recording_directory.h"

#include <fcntl.h>
#include <stdio.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <fstream>
#include <string>
#include <system_error>
#include <utility>

#include "esim/core/error.h"
#include "esim/record/output_file.h"

namespace esim {
namespace {

namespace fs = std::filesystem;

// "out/" and "./out" name the same directory as "out".
fs::path normalised(const fs::path& out) {
  fs::path path = out.lexically_normal();
  if (path.has_relative_path() && !path.has_filename()) path = path.parent_path();
  if (!path.has_filename() || path.filename() == "." || path.filename() == "..") {
    throw UserError("cannot record to \"" + out.string() + "\": name a new directory with --out");
  }
  return path;
}

bool looks_like_a_recording(const fs::path& directory) {
  std::error_code error;
  return fs::exists(directory / "report.json", error) || fs::exists(directory / "scenario.yaml", error) ||
         fs::is_empty(directory, error);
}

bool is_home(const fs::path& directory) {
  const char* home = std::getenv("HOME");
  std::error_code error;
  return home != nullptr && *home != '\0' && fs::equivalent(directory, home, error);
}

// --force deletes: only what is surely a recording.
void require_replaceable(const fs::path& directory) {
  const auto refuse = [&](const std::string& why) {
    throw UserError(directory.string() + " " + why + ": not replaced, choose another name");
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

// Moves `from` to `to` where nothing may be, or exchanges the two. Some file systems cannot do either in one step.
bool rename_in_one_step(const fs::path& from, const fs::path& to, unsigned flag) {
  if (::renameat2(AT_FDCWD, from.c_str(), AT_FDCWD, to.c_str(), flag) == 0) return true;
  if (errno == EINVAL || errno == ENOSYS) return false;
  throw std::system_error(errno, std::generic_category());
}

// An exchange leaves the old recording in `working`, where it is removed.
void replace_directory(const fs::path& working, const fs::path& out) {
  fs::path old = working;
  if (!rename_in_one_step(working, out, RENAME_EXCHANGE)) {
    old = out;
    old += ".replaced";
    fs::rename(out, old);
    fs::rename(working, out);
  }
  fs::remove_all(old);
}

}  // namespace

fs::path incomplete_path(const fs::path& out) {
  fs::path path = out;
  path += ".incomplete";
  return path;
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
  // What is there already?
  std::error_code error;
  const fs::file_status status = fs::symlink_status(out_, error);
  if (fs::exists(status)) {
    if (!fs::is_directory(status) && !fs::is_symlink(status)) {
      throw UserError(out_.string() + " is a file: choose another name");
    }
    if (!force) throw UserError(out_.string() + " exists already: pass --force to replace it, or choose another name");
    require_replaceable(out_);
    replace_ = true;
  } else if (status.type() == fs::file_type::none) {
    throw UserError("cannot record to " + out_.string() + ": " + error.message());
  }

  try {
    create_parents();
    create_working_directory(force);
    write_file_atomically(working_ / "report.json", "{\"status\": \"running\"}\n");
  } catch (...) {
    discard();
    throw;
  }
}

void RecordingDirectory::create_parents() {
  // From the outermost missing one on, so that an error can take back what was made.
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
      throw UserError("cannot create the directory " + parent->string() + ": " + system_reason(errno));
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
      throw UserError(working_.string() +
                      " is left from a run that was killed: look at it with `esim info`, pass --force to replace it, "
                      "or choose another name");
    }
    require_replaceable(working_);
    fs::remove_all(working_, error);
    if (error) throw UserError("cannot remove " + working_.string() + ": " + error.message());
  }
  if (::mkdir(working_.c_str(), 0777) != 0) {
    throw UserError("cannot create the directory " + working_.string() + ": " + system_reason(errno));
  }
  owned_ = true;
  lock_ = lock_directory(working_);
}

RecordingDirectory::~RecordingDirectory() { discard(); }

void RecordingDirectory::discard() noexcept {
  if (!keep_) {
    std::error_code error;
    if (owned_) fs::remove_all(working_, error);
    for (auto parent = created_parents_.rbegin(); parent != created_parents_.rend(); ++parent) {
      ::rmdir(parent->c_str());  // stays if somebody else uses it meanwhile
    }
    created_parents_.clear();
  }
  if (lock_ >= 0) ::close(std::exchange(lock_, -1));
}

void RecordingDirectory::finish(std::string_view report_json) {
  write_file_atomically(working_ / "report.json", report_json);
  sync_directory(working_);
  keep_ = true;
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

bool has_conversion_report(const fs::path& folder) {
  constexpr std::streamsize kMostBytes = 1 << 16;
  std::ifstream file(folder / "report.json", std::ios::binary);
  std::string text(static_cast<std::size_t>(kMostBytes), '\0');
  file.read(text.data(), kMostBytes);
  text.resize(static_cast<std::size_t>(file.gcount()));
  return text.find("\"converted_from\"") != std::string::npos;
}

}  // namespace esim
