#pragma once

#include <string>
#include <vector>

#include "esim/recording/record.h"

namespace esim::inline recording {

/// The input of a recording: the counterpart of Sink, one class per format.
class Source {
 public:
  virtual ~Source() = default;

  /// The description, known before the first record. The start is not later than the first record; if the format does
  /// not state it (`start_known` is false), it is the time of the first record, or 0 without records. Other unknown
  /// values are 0 or empty: sizes and intrinsics of cameras, and the end, which is then equal to the start.
  virtual const RecordingInfo& info() const = 0;

  /// The next record, borrowed until the next call; null at the end. Records come in order of time per camera and kind;
  /// events in portions of some 10^4 to 10^5. Throws UserError (which file, at which byte, what is wrong) if the file
  /// is damaged: then everything before the damage has been handed out, and nothing follows.
  virtual const Record* next() = 0;

  /// Unsupported parts of the input, as text: "/events (event_camera_msgs/EventPacket)". Complete only after everything
  /// has been read.
  virtual std::vector<std::string> not_read() const { return {}; }

  /// The fraction of the input that has been read, 0 to 1.
  virtual double progress() const = 0;
};

}  // namespace esim::inline recording
