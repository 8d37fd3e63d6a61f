#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <vector>

#include "esim/formats/hdf5/truth.h"
#include "esim/recording/record_stream.h"

namespace esim::inline formats {

/// The parts of a recording's folder as streams of records. If the recording is `unfinished`, because its writer was
/// killed or is still writing, a last line without a line end is ignored, and of files that belong together, the
/// shortest determines their end.

/// states.csv and the files of the objects.
std::unique_ptr<RecordStream> poses_stream(const std::filesystem::path& states,
                                           const std::vector<std::filesystem::path>& objects, bool unfinished = false);

/// imu.csv, and its biases from the second file; without it they are 0.
std::unique_ptr<RecordStream> imu_stream(const std::filesystem::path& measured, const std::filesystem::path& biases,
                                         bool unfinished = false);

/// A file of one camera's events, read by its Source.
std::unique_ptr<RecordStream> events_stream(std::unique_ptr<Source> events, int camera);

/// frames.csv and its images. Demosaicked colour is converted back to the mosaic.
std::unique_ptr<RecordStream> frames_stream(const std::filesystem::path& folder, int camera, bool unfinished = false);

/// images/ with its list. An image at the time of a ground-truth frame is the irradiance of that frame, not a separate
/// record.
class ImagesStream final : public RecordStream {
 public:
  ImagesStream(const std::filesystem::path& folder, int camera, bool unfinished = false);
  ~ImagesStream() override;

  std::optional<TimeNs> due() override;
  const Record* next(TimeNs until) override;

  /// The last image that was read, if it is at this time; otherwise an empty one.
  const Image<float>& at(TimeNs t) const;

  /// `shows` returns whether the next ground-truth frame is at this time.
  void leave_to_truth(std::function<bool(TimeNs)> shows);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// truth.h5, with the irradiance from images at the same times, which the stream of images reads first; null: no
/// images.
std::unique_ptr<RecordStream> truth_stream(std::shared_ptr<const TruthHdf5Reader> truth, int camera,
                                           ImagesStream* images);

}  // namespace esim::inline formats
