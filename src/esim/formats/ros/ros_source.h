#pragma once

#include <filesystem>
#include <functional>
#include <memory>

#include "esim/formats/ros/message_file.h"
#include "esim/recording/format.h"

namespace esim::inline formats::ros {

/// A recording from a file of ROS messages, on any topics (topics.h). `open` opens the file from its start, more than
/// once. Throws UserError, with the topics and their types, if none of them is supported.
std::unique_ptr<Source> make_source(const std::filesystem::path& path,
                                    const std::function<std::unique_ptr<MessageInput>()>& open,
                                    const ReadOptions& options);

}  // namespace esim::inline formats::ros
