#include "esim/recording/recording_file.h"

#include <string>
#include <system_error>
#include <utility>

#include "esim/core/error.h"
#include "esim/core/remedy.h"
#include "esim/files/output_file.h"
#include "esim/recording/recording_directory.h"

namespace esim::inline recording {

namespace fs = std::filesystem;

RecordingFile::RecordingFile(fs::path out, bool force) : out_(std::move(out)), working_(incomplete_path(out_)) {
  const fs::path folder = out_.has_parent_path() ? out_.parent_path() : fs::path(".");
  std::error_code error;
  if (!fs::is_directory(folder, error)) {
    throw OutputError("cannot write " + out_.string() + ": " + folder.string() + " is not a folder; create it");
  }
  for (const fs::path& path : {out_, working_}) {
    const fs::file_status status = fs::symlink_status(path, error);
    if (!fs::exists(status)) continue;
    if (!fs::is_regular_file(status)) throw UserError(path.string() + " is not a file: choose another name");
    if (!force) {
      throw RemediableError(path.string() + " exists already: choose another name", Remedy::replace_output);
    }
  }
}

RecordingFile::~RecordingFile() {
  if (kept_) return;
  std::error_code ignored;
  for (const fs::path& part : parts()) fs::remove(part, ignored);
  fs::remove(working_, ignored);
}

/// The temporary parts of archives, such as OUT.incomplete.t.npy and OUT.incomplete.part0.
std::vector<fs::path> RecordingFile::parts() const {
  const std::string prefix = working_.filename().string() + ".";
  const fs::path folder = working_.has_parent_path() ? working_.parent_path() : fs::path(".");
  std::vector<fs::path> found;
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error)) {
    const std::string name = entry->path().filename().string();
    const std::string extension = entry->path().extension().string();
    const bool is_part = extension == ".npy" || extension.starts_with(".part");
    if (is_part && name.starts_with(prefix)) found.push_back(entry->path());
  }
  return found;
}

void RecordingFile::finish() {
  std::error_code error;
  fs::rename(working_, out_, error);
  kept_ = true;
  if (error) {
    throw OutputError("cannot rename " + working_.string() + " to " + out_.string() + ": " + error.message() +
                      "; the recording is kept in the former");
  }
  sync_directory(out_.has_parent_path() ? out_.parent_path() : fs::path("."));
}

}  // namespace esim::inline recording
