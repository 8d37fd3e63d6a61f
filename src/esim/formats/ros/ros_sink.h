#pragma once

#include <filesystem>
#include <functional>
#include <memory>

#include "esim/formats/ros/message_file.h"
#include "esim/recording/record.h"

namespace esim::inline formats::ros {

/// Writes a recording as ROS messages on the topics of topics.h. `create` makes the file, with messages in `encoding`;
/// `path` is its name in errors. Throws UserError for times that ROS cannot hold.
std::unique_ptr<Sink> make_sink(std::filesystem::path path, Encoding encoding,
                                std::function<std::unique_ptr<MessageOutput>()> create);

}  // namespace esim::inline formats::ros
