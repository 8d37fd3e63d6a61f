#pragma once

#include <filesystem>
#include <functional>
#include <memory>

#include "esim/record/formats/ros/message_file.h"
#include "esim/record/record.h"

namespace esim::ros {

/// Writes a recording as ROS messages on the topics of topics.h. `create` makes the file, with messages in `encoding`;
/// `path` is its name in errors. Throws UserError for times that ROS cannot hold.
std::unique_ptr<Sink> make_sink(std::filesystem::path path, Encoding encoding,
                                std::function<std::unique_ptr<MessageOutput>()> create);

}  // namespace esim::ros
