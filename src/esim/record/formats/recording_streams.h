#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <vector>

#include "esim/record/formats/truth_hdf5.h"
#include "esim/record/record_stream.h"

namespace esim {

/// The parts of a recording's folder as streams of records. Where the recording is `unfinished`, because who wrote it
/// was killed or is still writing, a last line without its end is no line, and of files that belong together, the
/// shortest tells where they end.

/// states.csv and the objects' files.
std::unique_ptr<RecordStream> poses_stream(const std::filesystem::path& states,
                                           const std::vector<std::filesystem::path>& objects, bool unfinished = false);

/// imu.csv, and the biases where there is a second file; else they are 0.
std::unique_ptr<RecordStream> imu_stream(const std::filesystem::path& measured, const std::filesystem::path& biases,
                                         bool unfinished = false);

/// A file of one camera's events, as its Source gives them.
std::unique_ptr<RecordStream> events_stream(std::unique_ptr<Source> events, int camera);

/// frames.csv and the images beside it. Demosaicked colour becomes the mosaic again that it was made of.
std::unique_ptr<RecordStream> frames_stream(const std::filesystem::path& folder, int camera, bool unfinished = false);

/// images/ with its list. An image of the same time as a frame of ground truth is that frame's irradiance, and no
/// record of its own.
class ImagesStream final : public RecordStream {
 public:
  ImagesStream(const std::filesystem::path& folder, int camera, bool unfinished = false);
  ~ImagesStream() override;

  std::optional<TimeNs> due() override;
  const Record* next(TimeNs until) override;

  /// The image that was read last, if it is of this time; an empty one otherwise.
  const Image<float>& at(TimeNs t) const;

  /// `shows` says whether the frame of ground truth that comes next is of this time.
  void leave_to_truth(std::function<bool(TimeNs)> shows);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// truth.h5, with the irradiance of the images of the same times, which the stream before it reads; null: none.
std::unique_ptr<RecordStream> truth_stream(std::shared_ptr<const TruthHdf5Reader> truth, int camera,
                                           ImagesStream* images);

}  // namespace esim
