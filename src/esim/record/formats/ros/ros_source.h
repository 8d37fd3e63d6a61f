#pragma once

#include <filesystem>
#include <functional>
#include <memory>

#include "esim/record/format.h"
#include "esim/record/formats/ros/message_file.h"

namespace esim::ros {

/// A recording from a file of ROS messages, on whatever topics they are (topics.h). `open` opens the file anew. Throws
/// UserError, with the topics and their types, where none of them is one of a recording.
std::unique_ptr<Source> make_source(const std::filesystem::path& path,
                                    const std::function<std::unique_ptr<MessageInput>()>& open,
                                    const ReadOptions& options);

}  // namespace esim::ros
