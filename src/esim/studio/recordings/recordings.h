#pragma once

#include <atomic>
#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "esim/studio/recordings/recording_view.h"

namespace esim::studio {

/// An open recording. For formats without an index, the beginning is available at once; the rest follows when a
/// background thread has converted all of it to a temporary recording folder.
class OpenRecording {
 public:
  /// Throws UserError if nothing can be read.
  explicit OpenRecording(const std::filesystem::path& path);

  /// Stops the conversion and removes the copy.
  ~OpenRecording();
  OpenRecording(const OpenRecording&) = delete;
  OpenRecording& operator=(const OpenRecording&) = delete;

  /// The part that is available now.
  std::shared_ptr<const RecordingView> view() const;

  const std::filesystem::path& path() const { return path_; }
  const std::string& format() const { return format_; }

  /// The converted fraction; 1 if complete or if no conversion is needed.
  double indexed() const { return indexed_; }

  /// Why only the beginning is available; empty if there is no problem.
  std::string problem() const;

 private:
  void copy();

  std::filesystem::path path_;
  std::string format_;
  std::filesystem::path folder_;  // of the copy; empty without a copy
  std::atomic<double> indexed_{1};
  std::atomic<bool> stop_{false};
  mutable std::mutex mutex_;
  std::shared_ptr<const RecordingView> view_;
  std::string problem_;
  std::thread thread_;
};

/// The recently opened recordings.
class Recordings {
 public:
  /// The id of the recording at a path; it changes when the recording is replaced.
  std::string open(const std::filesystem::path& path);

  /// Throws HttpError 404 if it has been closed.
  std::shared_ptr<OpenRecording> find(const std::string& id) const;

 private:
  struct Entry {
    std::string key;
    std::shared_ptr<OpenRecording> recording;
  };
  mutable std::mutex mutex_;
  std::map<int, Entry> entries_;
  int last_ = 0;
};

}  // namespace esim::studio
