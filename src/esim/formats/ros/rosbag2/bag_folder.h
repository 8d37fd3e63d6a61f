#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "esim/core/time.h"

namespace esim::inline formats::rosbag2 {

inline constexpr const char* kMetadataFile = "metadata.yaml";

/// A topic in the metadata of a bag.
struct Topic {
  std::string name{}, type{};
  std::uint64_t messages = 0;
};

/// The content of metadata.yaml, version 8, which ROS 2 Humble and later ones read, of a bag with one SQLite file.
std::string metadata_of(const std::string& file, const std::vector<Topic>& topics, TimeNs first, TimeNs last);

/// How publishers of a topic offer its messages, as in the metadata and the database: transforms that do not change are
/// kept for late subscribers.
std::string offered_qos(const std::string& topic);

/// The files of a bag, as its metadata lists them. Throws UserError if the metadata is damaged, a file is missing or
/// outside the folder, or files are compressed as a whole.
std::vector<std::filesystem::path> files_of_bag(const std::filesystem::path& folder);

}  // namespace esim::inline formats::rosbag2
