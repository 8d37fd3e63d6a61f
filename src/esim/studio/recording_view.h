#pragma once

#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "esim/record/formats/truth_hdf5.h"
#include "esim/record/preview/colours.h"
#include "esim/record/preview/scales.h"
#include "esim/record/record.h"
#include "esim/studio/event_store.h"

namespace esim::studio {

/// A file with an image, and when it was seen.
struct TimedFile {
  TimeNs t = 0;
  std::filesystem::path file{};
};

/// What one camera of a recording has.
struct CameraView {
  CameraInfo info{};
  std::unique_ptr<EventStore> events{};      ///< null: none
  std::vector<TimedFile> images{};           ///< PNG; frames of a frame camera rather than other images
  std::unique_ptr<TruthHdf5Reader> truth{};  ///< null: none
  std::vector<TimeNs> truth_times{};
  bool depth = false, flow = false;
  DepthScale depth_scale{};
  FlowScale flow_scale{};
};

/// A recording, of which any part can be had at once: only indices are in memory.
class RecordingView {
 public:
  enum class Kind { depth, flow };

  /// The folder of a recording or of one of its cameras, or a file of events in DSEC's layout. Parts that cannot be
  /// read are left out, and noted. Throws UserError where nothing can be read, and for other formats.
  explicit RecordingView(const std::filesystem::path& path);

  /// The beginning of a recording of any format, which is read until there are many events or a while has passed.
  static std::unique_ptr<RecordingView> beginning_of(const std::filesystem::path& path);

  /// Whether a path is of a kind that the constructor takes.
  static bool takes(const std::filesystem::path& path);

  const std::vector<CameraView>& cameras() const { return cameras_; }
  TimeSpan span() const { return span_; }
  bool incomplete() const { return incomplete_; }
  const std::vector<std::string>& notes() const { return notes_; }
  bool has_imu() const { return !imu_file_.empty(); }
  bool has_poses() const { return !states_file_.empty(); }

  /// Throws HttpError 404 where there is none of that name; empty: the first.
  const CameraView& camera(const std::string& name) const;

  /// Ground truth in colours, as it was last at or before `t`, and when that was; nothing where there is none.
  std::optional<std::pair<Image<Rgb>, TimeNs>> truth_at(const CameraView& camera, Kind kind, TimeNs t) const;

  /// A file with an image; nothing where it cannot be read, or is a link that leads out of the recording.
  std::optional<std::string> bytes_of(const TimedFile& image) const;

  /// All of them, read when they are first wanted.
  const std::vector<ImuRecord>& imu() const;
  const std::vector<PoseRecord>& poses() const;

 private:
  RecordingView() = default;
  void open_camera(const std::filesystem::path& folder, CameraInfo info);
  void open_events(const std::filesystem::path& file, CameraView& camera);
  void open_images(const std::filesystem::path& folder, CameraView& camera);
  void open_truth(const std::filesystem::path& file, CameraView& camera);
  void read_report(const std::filesystem::path& file);
  bool has_file(const std::filesystem::path& file) const;

  template <typename Part>
  void attempt(const Part& part);

  std::filesystem::path folder_;  // without links
  std::vector<CameraView> cameras_;
  TimeSpan span_{};
  bool incomplete_ = false;
  std::vector<std::string> notes_;
  std::filesystem::path imu_file_, states_file_;

  mutable std::mutex mutex_;  // of all below, and of the readers of ground truth
  mutable std::optional<std::vector<ImuRecord>> imu_;
  mutable std::optional<std::vector<PoseRecord>> poses_;
};

}  // namespace esim::studio
