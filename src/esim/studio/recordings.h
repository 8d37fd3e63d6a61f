#pragma once

#include <atomic>
#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "esim/studio/recording_view.h"

namespace esim::studio {

/// A recording that has been opened. Of formats without an index its beginning is seen at once, and the rest when all
/// of it has been copied, in the background, into a recording's folder among the system's temporary files.
class OpenRecording {
 public:
  /// Throws UserError where there is nothing to read.
  explicit OpenRecording(const std::filesystem::path& path);

  /// Stops the copying, and removes the copy.
  ~OpenRecording();
  OpenRecording(const OpenRecording&) = delete;
  OpenRecording& operator=(const OpenRecording&) = delete;

  /// What is seen of it now.
  std::shared_ptr<const RecordingView> view() const;

  const std::string& format() const { return format_; }

  /// The share that has been copied; 1 where nothing is to be, or all is.
  double indexed() const { return indexed_; }

  /// Why it cannot be seen beyond its beginning; empty: it can.
  std::string problem() const;

 private:
  void copy(const std::filesystem::path& path);

  std::string format_;
  std::filesystem::path folder_;  // of the copy; empty: none
  std::atomic<double> indexed_{1};
  std::atomic<bool> stop_{false};
  mutable std::mutex mutex_;
  std::shared_ptr<const RecordingView> view_;
  std::string problem_;
  std::thread thread_;
};

/// The recordings that were opened last.
class Recordings {
 public:
  /// The id of the recording that is there now: the same as before if it is still the same.
  std::string open(const std::filesystem::path& path);

  /// Throws HttpError 404 where it has been forgotten.
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
