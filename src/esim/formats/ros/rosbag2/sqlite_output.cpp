#include "esim/formats/ros/rosbag2/sqlite_output.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "esim/core/error.h"
#include "esim/files/output_file.h"

namespace esim::inline formats::rosbag2 {
namespace {

namespace fs = std::filesystem;

constexpr const char* kFile = "bag_0.db3";
// After a crash, what was committed can be read.
constexpr std::size_t kCommit_bytes = std::size_t{32} << 20;

/// Version 4, of ROS 2 Iron and later ones. Earlier ones read the columns that they know.
constexpr std::string_view kTables = R"(
CREATE TABLE schema(schema_version INTEGER PRIMARY KEY, ros_distro TEXT NOT NULL);
CREATE TABLE metadata(id INTEGER PRIMARY KEY, metadata_version INTEGER NOT NULL, metadata TEXT NOT NULL);
CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL, serialization_format TEXT NOT NULL,
  offered_qos_profiles TEXT NOT NULL, type_description_hash TEXT NOT NULL);
CREATE TABLE message_definitions(id INTEGER PRIMARY KEY, topic_type TEXT NOT NULL, encoding TEXT NOT NULL,
  encoded_message_definition TEXT NOT NULL, type_description_hash TEXT NOT NULL);
CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp INTEGER NOT NULL, data BLOB NOT NULL);
CREATE INDEX timestamp_idx ON messages (timestamp ASC);
INSERT INTO schema VALUES (4, '');
BEGIN;
)";

}  // namespace

SqliteOutput::SqliteOutput(fs::path folder) : folder_(std::move(folder)) {
  std::error_code error;
  fs::create_directories(folder_, error);
  if (error) throw OutputError(fmt::format("cannot create the folder {}: {}", folder_.string(), error.message()));
  for (const char* name : {kMetadataFile, kFile}) fs::remove(folder_ / name, error);
  try {
    file_.emplace(folder_ / kFile, SqliteFile::Access::create);
    file_->execute(kTables);
    insert_.emplace(*file_, "INSERT INTO messages (topic_id, timestamp, data) VALUES (?, ?, ?)");
  } catch (const SqliteError& e) {
    fail(e.reason);
  }
}

void SqliteOutput::fail(const std::string& reason) const {
  throw OutputError(fmt::format("cannot write {}: {}", (folder_ / kFile).string(), reason));
}

std::size_t SqliteOutput::topic(const std::string& name, ros::MessageType type) {
  const auto [entry, is_new] = topic_of_name_.try_emplace(name, topics_.size());
  if (!is_new) return entry->second;
  const std::string type_name = ros::ros2_name_of(type), definition = ros::definition_of(type, ros::Encoding::cdr),
                    qos = offered_qos(name);
  const bool new_type = std::ranges::find(topics_, type_name, &Topic::type) == topics_.end();
  SqliteStatement(*file_, "INSERT INTO topics VALUES (?, ?, ?, 'cdr', ?, '')")
      .bind(0, static_cast<std::int64_t>(entry->second) + 1)
      .bind_text(1, name)
      .bind_text(2, type_name)
      .bind_text(3, qos)
      .step();
  if (new_type) {
    SqliteStatement(*file_,
                    "INSERT INTO message_definitions (topic_type, encoding, encoded_message_definition, "
                    "type_description_hash) VALUES (?, 'ros2msg', ?, '')")
        .bind_text(0, type_name)
        .bind_text(1, definition)
        .step();
  }
  topics_.push_back({name, type_name});
  return entry->second;
}

void SqliteOutput::write(const std::string& topic_name, ros::MessageType type, TimeNs t, std::string_view payload) {
  try {
    const std::size_t index = topic(topic_name, type);
    insert_->bind(0, static_cast<std::int64_t>(index) + 1).bind(1, t).bind_blob(2, payload).step();
    const bool first = std::ranges::all_of(topics_, [](const Topic& each) { return each.messages == 0; });
    first_ = first ? t : std::min(first_, t);
    last_ = first ? t : std::max(last_, t);
    ++topics_[index].messages;
    uncommitted_bytes_ += payload.size();
    if (uncommitted_bytes_ < kCommit_bytes) return;
    file_->execute("COMMIT; BEGIN");
    uncommitted_bytes_ = 0;
  } catch (const SqliteError& error) {
    fail(error.reason);
  }
}

void SqliteOutput::close() {
  const std::string metadata = metadata_of(kFile, topics_, first_, last_);
  try {
    insert_.reset();
    SqliteStatement(*file_, "INSERT INTO metadata (metadata_version, metadata) VALUES (8, ?)")
        .bind_text(0, metadata)
        .step();
    file_->execute("COMMIT");
    file_->close();
  } catch (const SqliteError& error) {
    fail(error.reason);
  }
  write_file_atomically(folder_ / kMetadataFile, metadata);
}

}  // namespace esim::inline formats::rosbag2
