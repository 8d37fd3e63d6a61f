#include "esim/formats/ros/rosbag2/bag_folder.h"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>

#include "esim/core/error.h"
#include "esim/files/input_file.h"
#include "esim/formats/ros/topics.h"

namespace esim::inline formats::rosbag2 {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxMetadataBytes = std::size_t{16} << 20;

/// Indents all lines of a text.
std::string indented(const std::string& text, const std::string& by) {
  std::string out;
  for (std::size_t i = 0; i < text.size();) {
    const std::size_t end = std::min(text.find('\n', i), text.size() - 1);
    out += by + text.substr(i, end + 1 - i);
    i = end + 1;
  }
  return out;
}

}  // namespace

std::string offered_qos(const std::string& topic) {
  if (topic != ros::topic::kStaticTransforms) return "";
  constexpr std::string_view kForever = "\n    sec: 9223372036\n    nsec: 854775807\n";
  return fmt::format(
      "- history: 1\n  depth: 1\n  reliability: 1\n  durability: 1\n  deadline:{0}  lifespan:{0}  liveliness: 1\n"
      "  liveliness_lease_duration:{0}  avoid_ros_namespace_conventions: false\n",
      kForever);
}

std::string metadata_of(const std::string& file, const std::vector<Topic>& topics, TimeNs first, TimeNs last) {
  std::uint64_t messages = 0;
  std::string list;
  for (const Topic& topic : topics) {
    const std::string qos = offered_qos(topic.name);
    list += fmt::format(
        "    - topic_metadata:\n        name: {}\n        type: {}\n        serialization_format: cdr\n"
        "        offered_qos_profiles: {}\n        type_description_hash: \"\"\n      message_count: {}\n",
        topic.name, topic.type, qos.empty() ? "\"\"" : "|\n" + indented(qos.substr(0, qos.size() - 1), "          "),
        topic.messages);
    messages += topic.messages;
  }
  const std::string span =
      fmt::format("duration:\n  nanoseconds: {}\nstarting_time:\n  nanoseconds_since_epoch: {}\nmessage_count: {}\n",
                  last - first, first, messages);
  return fmt::format(
      "rosbag2_bagfile_information:\n  version: 8\n  storage_identifier: sqlite3\n  relative_file_paths:\n    - {0}\n"
      "{1}  topics_with_message_count:{2}\n{3}  compression_format: \"\"\n  compression_mode: \"\"\n"
      "  files:\n    - path: {0}\n{4}  custom_data: ~\n  ros_distro: \"\"\n",
      file, indented(span, "  "), topics.empty() ? " []" : "", list, indented(span, "      "));
}

std::vector<fs::path> files_of_bag(const fs::path& folder) {
  const fs::path metadata = folder / kMetadataFile;
  const auto fail = [&](const std::string& reason) -> void {
    throw UserError(fmt::format("cannot read {}: {}", metadata.string(), reason));
  };
  std::vector<fs::path> files;
  try {
    const YAML::Node bag = YAML::Load(read_head(metadata, kMaxMetadataBytes))["rosbag2_bagfile_information"];
    if (!bag || !bag.IsMap()) fail("it has no \"rosbag2_bagfile_information\"");
    if (bag["compression_mode"] && bag["compression_mode"].as<std::string>("") == "FILE")
      fail("its files are compressed; decompress them first, with `ros2 bag convert`");
    for (const YAML::Node& entry : bag["relative_file_paths"]) {
      const fs::path file = entry.as<std::string>();
      if (file.is_absolute() || file.lexically_normal().string().starts_with(".."))
        fail(fmt::format("\"{}\" is outside the bag", file.string()));
      files.push_back(folder / file);
    }
  } catch (const YAML::Exception& error) {
    fail(fmt::format("line {}: {}", error.mark.line + 1, error.msg));
  }
  if (files.empty()) fail("it lists no files");
  return files;
}

}  // namespace esim::inline formats::rosbag2
