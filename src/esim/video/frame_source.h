#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "esim/core/time.h"
#include "esim/scene/planes.h"

namespace esim::inline video {

/// A sequence of frames from a video file or a folder of images. Frames are counted from 0.
class FrameSource {
 public:
  virtual ~FrameSource() = default;

  /// Known before decoding.
  struct Listing {
    std::size_t frames = 0;
    std::vector<TimeNs> stamps;  ///< one per frame; empty if the source has none
  };
  virtual const Listing& listing() const = 0;

  /// Advances to the next frame, on the first call to the first one; false at the end. Throws UserError naming the
  /// frame that should follow.
  virtual bool advance() = 0;

  /// Time of the current frame; nothing if the source has no time stamps.
  virtual std::optional<TimeNs> stamp() const = 0;

  /// The irradiance of the current frame, linear. Throws UserError naming the frame.
  virtual void read(Planes& planes) = 0;

  /// Names the current frame in messages: "frame 12 (000012.png)".
  virtual std::string name() const = 0;
};

/// The frames of a video file's best video stream in order of presentation, with the time stamps of the stream. Decoded
/// by libav. Throws UserError if libav cannot decode it.
std::unique_ptr<FrameSource> open_video_file(const std::filesystem::path& path, Encoding encoding, bool colour);

/// The images of a folder: those that images.csv names (lines `timestamp in ns, file`), or those that timestamps.txt
/// names (lines `seconds file` or `index seconds file`), or all of them in natural order, with the stamps of
/// timestamps.txt (lines `seconds`) or none. Throws UserError for missing or inconsistent files.
std::unique_ptr<FrameSource> open_image_folder(const std::filesystem::path& folder, Encoding encoding, bool colour);

}  // namespace esim::inline video
