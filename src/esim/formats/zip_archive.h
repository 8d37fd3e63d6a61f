#pragma once

#include <deque>
#include <filesystem>
#include <memory>
#include <string>

struct zip;  // libzip's archive

namespace esim::inline formats {

/// Packs files into a zip, through libzip. Nothing is read or written before close(). The same content gives the same
/// bytes, and each file's header states its size, for programs that do not read the list at the end of the zip.
/// Failures are OutputErrors.
class ZipWriter {
 public:
  explicit ZipWriter(std::filesystem::path path);

  enum class Packing { stored, deflated };

  void add_file(const std::string& name, const std::filesystem::path& file, Packing packing);
  void add(const std::string& name, std::string content, Packing packing);

  /// Writes the zip and makes it durable.
  void close();

 private:
  void add_source(const std::string& name, void* source, Packing packing);
  [[noreturn]] void fail() const;

  std::filesystem::path path_;
  std::deque<std::string> contents_;
  std::unique_ptr<::zip, void (*)(::zip*)> archive_;
};

}  // namespace esim::inline formats
