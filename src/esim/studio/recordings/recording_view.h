#pragma once

#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "esim/formats/hdf5/truth.h"
#include "esim/preview/colours.h"
#include "esim/preview/scales.h"
#include "esim/recording/record.h"
#include "esim/studio/recordings/event_store.h"

namespace esim::studio {

/// A file with an image, and the time of the image.
struct TimedFile {
  TimeNs t = 0;
  std::filesystem::path file{};
};

/// The data of one camera of a recording.
struct CameraView {
  CameraInfo info{};
  std::unique_ptr<EventStore> events{};      ///< null: none
  std::vector<TimedFile> images{};           ///< PNG; frames of a frame camera if there are any, otherwise other images
  std::unique_ptr<TruthHdf5Reader> truth{};  ///< null: none
  std::vector<TimeNs> truth_times{};
  bool depth = false, motion_field = false;
  bool samples = false;  ///< of its pixels, for other sensors
  DepthScale depth_scale{};
  MotionScale motion_scale{};
};

/// A recording with random access: only indices are in memory.
class RecordingView {
 public:
  enum class Kind { depth, motion_field };

  /// Opens the folder of a recording or of one of its cameras, or an event file in DSEC's layout. Unreadable parts are
  /// left out with a note. Throws UserError if nothing can be read, and for other formats.
  explicit RecordingView(const std::filesystem::path& path);

  /// The beginning of a recording of any format: reads up to a number of events or a time limit.
  static std::unique_ptr<RecordingView> beginning_of(const std::filesystem::path& path);

  /// Whether the constructor supports a path.
  static bool takes(const std::filesystem::path& path);

  const std::vector<CameraView>& cameras() const { return cameras_; }
  TimeSpan span() const { return span_; }
  bool incomplete() const { return incomplete_; }
  const std::vector<std::string>& notes() const { return notes_; }
  bool has_imu() const { return !imu_file_.empty(); }
  bool has_poses() const { return !states_file_.empty(); }

  /// The camera with this name; the first if empty. Throws HttpError 404 if it does not exist.
  const CameraView& camera(const std::string& name) const;

  /// The last ground truth at or before `t` as a colour image, with its time; empty without ground truth.
  std::optional<std::pair<Image<Rgb>, TimeNs>> truth_at(const CameraView& camera, Kind kind, TimeNs t) const;

  /// The bytes of an image file; empty if it cannot be read, or is a link that leads out of the recording.
  std::optional<std::string> bytes_of(const TimedFile& image) const;

  /// All records, read on first use.
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

  std::filesystem::path folder_;  // with links resolved
  std::vector<CameraView> cameras_;
  TimeSpan span_{};
  bool incomplete_ = false;
  std::vector<std::string> notes_;
  std::filesystem::path imu_file_, states_file_;

  mutable std::mutex mutex_;  // of all members below, and of the readers of ground truth
  mutable std::optional<std::vector<ImuRecord>> imu_;
  mutable std::optional<std::vector<PoseRecord>> poses_;
};

}  // namespace esim::studio
