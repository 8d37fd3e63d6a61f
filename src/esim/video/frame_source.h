#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "esim/core/time.h"
#include "esim/scene/planes.h"

namespace esim {

/// Frames one after the other, from a video file or a folder of images. Frames are counted from 0.
class FrameSource {
 public:
  virtual ~FrameSource() = default;

  /// What is known before anything is decoded.
  struct Listing {
    std::size_t frames = 0;
    std::vector<TimeNs> stamps;  ///< one per frame; empty if the source has none
  };
  virtual const Listing& listing() const = 0;

  /// Moves on to the next frame, the first one at first; false at the end. Throws UserError naming the frame that
  /// should follow.
  virtual bool advance() = 0;

  /// When the current frame was taken; nothing if the source does not say.
  virtual std::optional<TimeNs> stamp() const = 0;

  /// The current frame in linear light. Throws UserError naming it.
  virtual void read(Planes& planes) = 0;

  /// Names the current frame in messages: "frame 12 (000012.png)".
  virtual std::string name() const = 0;
};

/// The frames of a video file's best video stream, in order of presentation, with the stamps of the stream: whatever
/// libav decodes. Throws UserError if it decodes nothing of it.
std::unique_ptr<FrameSource> open_video_file(const std::filesystem::path& path, Encoding encoding, bool colour);

/// The images of a folder: those that images.csv names (lines `timestamp in ns, file`), or those that timestamps.txt
/// names (lines `seconds file` or `index seconds file`), or all of them in natural order, with the stamps of
/// timestamps.txt (lines `seconds`) or none. Throws UserError for what is missing or inconsistent among these.
std::unique_ptr<FrameSource> open_image_folder(const std::filesystem::path& folder, Encoding encoding, bool colour);

}  // namespace esim
