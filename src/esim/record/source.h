#pragma once

#include <string>
#include <vector>

#include "esim/record/record.h"

namespace esim {

/// Where a recording comes from: the counterpart of Sink, one class per format.
class Source {
 public:
  virtual ~Source() = default;

  /// What is known before the first record. The start is not after it; where the format does not tell the start
  /// (`start_known` is false), it is the time of the first record, or 0 if there is none. What else the format does not
  /// tell is 0 or empty: sizes and intrinsics of cameras, and the end, which is then the start.
  virtual const RecordingInfo& info() const = 0;

  /// The next record, borrowed until the next call; null when there are none left. Records come in order of time per
  /// camera and kind; events in portions of some 10^4 to 10^5. Throws UserError (which file, at which byte, what is
  /// wrong) where the file is damaged: everything before that place has then been handed out, and no more will be.
  virtual const Record* next() = 0;

  /// What of the input is of no kind that can be read, for people: "/events (event_camera_msgs/EventPacket)". Complete
  /// only when everything has been read.
  virtual std::vector<std::string> not_read() const { return {}; }

  /// The fraction of the input that has been read, 0 to 1.
  virtual double progress() const = 0;
};

}  // namespace esim
