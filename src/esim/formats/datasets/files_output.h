#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <string_view>

namespace esim::inline formats {

/// Writes the files of a dataset to a folder or a zip. Failures are OutputErrors.
class FilesOutput {
 public:
  virtual ~FilesOutput() = default;

  /// Adds a complete file. Names may contain folders: "images/a.png".
  virtual void add(const std::string& name, std::string_view content) = 0;

  /// Appends to a text file, which is created empty. A few may grow at the same time.
  virtual void append(const std::string& name, std::string_view text) = 0;

  /// Makes everything durable.
  virtual void close() = 0;
};

std::unique_ptr<FilesOutput> make_folder_output(const std::filesystem::path& folder);

/// Until close(), the files are in the folder PATH.part, which stays if the process ends before. In the zip, added
/// files are stored and texts compressed. The same content gives the same bytes.
std::unique_ptr<FilesOutput> make_zip_output(const std::filesystem::path& path);

}  // namespace esim::inline formats
