#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>

#include "esim/formats/ros/messages/message_codec.h"

struct sqlite3;
struct sqlite3_stmt;

namespace esim::inline formats::rosbag2 {

/// What SQLite says about an error.
struct SqliteError {
  std::string reason;
};

/// An SQLite database, as a file. All functions throw SqliteError.
class SqliteFile {
 public:
  enum class Access { read, create };
  SqliteFile(const std::filesystem::path& path, Access access);

  /// Executes statements without results.
  void execute(std::string_view sql);

  /// Closes the file. Statements must have been destroyed.
  void close();

  sqlite3* handle() const { return handle_.get(); }

 private:
  struct Close {
    void operator()(sqlite3* handle) const;
  };
  std::unique_ptr<sqlite3, Close> handle_;
};

/// A prepared statement. Its parameters and columns count from 0.
class SqliteStatement {
 public:
  SqliteStatement(const SqliteFile& file, std::string_view sql);

  /// Values must stay until the next step().
  SqliteStatement& bind(int parameter, std::int64_t value);
  SqliteStatement& bind_text(int parameter, std::string_view value);
  SqliteStatement& bind_blob(int parameter, std::string_view value);

  /// True if there is a row; after the last one, false, and the statement can be executed again.
  bool step();

  std::int64_t integer(int column) const;
  std::string text(int column) const;
  ros::Bytes blob(int column) const;  ///< borrowed until the next step()

 private:
  void check(int result) const;

  struct Finalize {
    void operator()(sqlite3_stmt* statement) const;
  };
  std::unique_ptr<sqlite3_stmt, Finalize> statement_;
};

}  // namespace esim::inline formats::rosbag2
