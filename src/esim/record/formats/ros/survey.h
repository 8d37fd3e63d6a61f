#pragma once

#include <vector>

#include "esim/record/format.h"
#include "esim/record/formats/ros/message_file.h"
#include "esim/record/formats/ros/topics.h"

namespace esim::ros {

/// What has to be known of a file of messages before its first record.
struct Survey {
  RecordingInfo info{};
  std::vector<Assignment> channels{};
  bool damaged = false;  ///< it ended early, where the file is damaged
};

/// Looks at messages until each channel has had one, or at some ten megabytes of them; at all where the file has no
/// index. Stops at damage, which is left for the reader to tell.
Survey survey(MessageInput& input, const ReadOptions& options);

}  // namespace esim::ros
