#include "esim/formats/ros/rosbag2/sqlite_file.h"

#include <sqlite3.h>

#include "esim/formats/ros/chunk_codec.h"

namespace esim::inline formats::rosbag2 {
namespace {

void check(sqlite3* handle, int result) {
  if (result == SQLITE_OK) return;
  throw SqliteError{handle != nullptr ? sqlite3_errmsg(handle) : sqlite3_errstr(result)};
}

}  // namespace

void SqliteFile::Close::operator()(sqlite3* handle) const { sqlite3_close_v2(handle); }

SqliteFile::SqliteFile(const std::filesystem::path& path, Access access) {
  const int flags = access == Access::read ? SQLITE_OPEN_READONLY : SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE;
  sqlite3* handle = nullptr;
  const int result = sqlite3_open_v2(path.c_str(), &handle, flags | SQLITE_OPEN_NOMUTEX, nullptr);
  handle_.reset(handle);
  check(handle, result);
  // A damaged or hostile file must not run code of its own or allocate more than a message can need.
  for (const int option : {SQLITE_DBCONFIG_ENABLE_TRIGGER, SQLITE_DBCONFIG_ENABLE_VIEW, SQLITE_DBCONFIG_TRUSTED_SCHEMA})
    check(handle, sqlite3_db_config(handle, option, 0, nullptr));
  check(handle, sqlite3_db_config(handle, SQLITE_DBCONFIG_DEFENSIVE, 1, nullptr));
  sqlite3_limit(handle, SQLITE_LIMIT_LENGTH, static_cast<int>(ros::kMaxChunkBytes));
  execute("PRAGMA cell_size_check = ON");
}

void SqliteFile::execute(std::string_view sql) {
  check(handle(), sqlite3_exec(handle(), std::string(sql).c_str(), nullptr, nullptr, nullptr));
}

void SqliteFile::close() {
  check(handle(), sqlite3_close(handle()));
  static_cast<void>(handle_.release());
}

void SqliteStatement::Finalize::operator()(sqlite3_stmt* statement) const { sqlite3_finalize(statement); }

void SqliteStatement::check(int result) const {
  if (result != SQLITE_OK) rosbag2::check(sqlite3_db_handle(statement_.get()), result);
}

SqliteStatement::SqliteStatement(const SqliteFile& file, std::string_view sql) {
  sqlite3_stmt* statement = nullptr;
  rosbag2::check(file.handle(),
                 sqlite3_prepare_v2(file.handle(), sql.data(), static_cast<int>(sql.size()), &statement, nullptr));
  statement_.reset(statement);
}

SqliteStatement& SqliteStatement::bind(int parameter, std::int64_t value) {
  check(sqlite3_bind_int64(statement_.get(), parameter + 1, value));
  return *this;
}

SqliteStatement& SqliteStatement::bind_text(int parameter, std::string_view value) {
  check(sqlite3_bind_text64(statement_.get(), parameter + 1, value.data(), value.size(), SQLITE_STATIC, SQLITE_UTF8));
  return *this;
}

SqliteStatement& SqliteStatement::bind_blob(int parameter, std::string_view value) {
  check(sqlite3_bind_blob64(statement_.get(), parameter + 1, value.data(), value.size(), SQLITE_STATIC));
  return *this;
}

bool SqliteStatement::step() {
  const int result = sqlite3_step(statement_.get());
  if (result == SQLITE_ROW) return true;
  if (result != SQLITE_DONE) check(result);
  check(sqlite3_reset(statement_.get()));
  return false;
}

std::int64_t SqliteStatement::integer(int column) const { return sqlite3_column_int64(statement_.get(), column); }

std::string SqliteStatement::text(int column) const {
  const auto* const text = reinterpret_cast<const char*>(sqlite3_column_text(statement_.get(), column));
  return text == nullptr ? std::string() : text;
}

ros::Bytes SqliteStatement::blob(int column) const {
  const auto* const bytes = static_cast<const std::byte*>(sqlite3_column_blob(statement_.get(), column));
  return {bytes, static_cast<std::size_t>(sqlite3_column_bytes(statement_.get(), column))};
}

}  // namespace esim::inline formats::rosbag2
