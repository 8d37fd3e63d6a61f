#include "esim/studio/recordings/recordings.h"

#include <fmt/format.h>

#include <cstdlib>

#include "esim/core/error.h"
#include "esim/formats/copy_recording.h"
#include "esim/formats/formats.h"
#include "esim/studio/server/http.h"

namespace esim::studio {
namespace {

namespace fs = std::filesystem;

/// A fingerprint that changes when a recording is replaced.
std::string key_of(const fs::path& path) {
  std::error_code error;
  const fs::path report = path / "report.json";
  const fs::path& file = fs::exists(report, error) ? report : path;
  return fmt::format("{}:{}", path.string(), fs::last_write_time(file, error).time_since_epoch().count());
}

fs::path new_folder() {
  std::string name = (fs::temp_directory_path() / "esim-studio-XXXXXX").string();
  if (::mkdtemp(name.data()) == nullptr) throw UserError(name + ": cannot be created; is the disk full?");
  return name;
}

}  // namespace

OpenRecording::OpenRecording(const fs::path& path) : path_(path), format_(format_of(path).name) {
  if (RecordingView::takes(path)) {
    view_ = std::make_shared<const RecordingView>(path);
    return;
  }
  view_ = RecordingView::beginning_of(path);
  indexed_ = 0;
  folder_ = new_folder();
  thread_ = std::thread([this] { copy(); });
}

OpenRecording::~OpenRecording() {
  stop_ = true;
  if (thread_.joinable()) thread_.join();
  std::error_code error;
  if (!folder_.empty()) fs::remove_all(folder_, error);
}

void OpenRecording::copy() {
  std::string problem;
  try {
    const fs::path copy = folder_ / "recording";
    ConvertOptions options;
    options.copy.write = {TimeUnit::ns, Compression::none};  // fast, and without rounding of times
    options.read.recover = [&](const std::string& what) { problem = what; };
    convert_recording(path_, format_named("recording"), copy, options, [&](double share) {
      indexed_ = 0.99 * share;
      return !stop_;
    });
    if (!stop_) {
      auto view = std::make_shared<const RecordingView>(copy);
      const std::lock_guard lock(mutex_);
      view_ = std::move(view);
    }
  } catch (const std::exception& error) {
    problem = fmt::format("only the beginning is available: {}", error.what());
  }
  const std::lock_guard lock(mutex_);
  problem_ = problem;
  indexed_ = 1;
}

std::shared_ptr<const RecordingView> OpenRecording::view() const {
  const std::lock_guard lock(mutex_);
  return view_;
}

std::string OpenRecording::problem() const {
  const std::lock_guard lock(mutex_);
  return problem_;
}

std::string Recordings::open(const fs::path& path) {
  constexpr std::size_t kMax = 6;
  const std::string key = key_of(path);
  {
    const std::lock_guard lock(mutex_);
    for (const auto& [id, entry] : entries_) {
      if (entry.key == key) return std::to_string(id);
    }
  }
  auto recording = std::make_shared<OpenRecording>(path);
  std::shared_ptr<OpenRecording> forgotten;  // destroyed after the lock is released
  const std::lock_guard lock(mutex_);
  entries_[++last_] = {key, std::move(recording)};
  if (entries_.size() > kMax) {
    forgotten = std::move(entries_.begin()->second.recording);
    entries_.erase(entries_.begin());
  }
  return std::to_string(last_);
}

std::shared_ptr<OpenRecording> Recordings::find(const std::string& id) const {
  const std::lock_guard lock(mutex_);
  for (const auto& [number, entry] : entries_) {
    if (std::to_string(number) == id) return entry.recording;
  }
  throw HttpError(404, "this recording has been closed; open it again");
}

}  // namespace esim::studio
