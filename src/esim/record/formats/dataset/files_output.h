#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <string_view>

namespace esim {

/// Where the files of a dataset go: a folder, or a zip. Failures are OutputErrors.
class FilesOutput {
 public:
  virtual ~FilesOutput() = default;

  /// Adds a file at once. Names may have folders: "images/a.png".
  virtual void add(const std::string& name, std::string_view content) = 0;

  /// Appends to a text, which begins empty. A few may grow at the same time.
  virtual void append(const std::string& name, std::string_view text) = 0;

  /// Makes everything durable.
  virtual void close() = 0;
};

std::unique_ptr<FilesOutput> make_folder_output(const std::filesystem::path& folder);

/// Files that are added are stored as they are. Texts are packed while they grow, in files beside the zip that become
/// part of it in the end: memory does not grow with them. The same content gives the same bytes.
std::unique_ptr<FilesOutput> make_zip_output(const std::filesystem::path& path);

}  // namespace esim
