#pragma once

#include <vector>

#include "esim/formats/ros/message_file.h"
#include "esim/formats/ros/topics.h"
#include "esim/recording/format.h"

namespace esim::inline formats::ros {

/// The properties of a file of messages that are needed before its first record.
struct TopicSurvey {
  RecordingInfo info{};
  std::vector<Assignment> channels{};
  bool damaged = false;  ///< the survey ended at damage
};

/// Reads messages until each channel has had one, or up to 64 MiB; if the file has no index, reads all of it.
/// Stops at damage, which the reader reports.
TopicSurvey survey_topics(MessageInput& input, const ReadOptions& options);

}  // namespace esim::inline formats::ros
