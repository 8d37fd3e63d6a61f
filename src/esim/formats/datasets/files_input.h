#pragma once

#include <cstdint>
#include <filesystem>
#include <istream>
#include <memory>
#include <optional>
#include <string>

namespace esim::inline formats {

/// The files of a dataset, in a folder or a zip. Failures are UserErrors that name the file.
class FilesInput {
 public:
  virtual ~FilesInput() = default;

  virtual bool has(const std::string& name) const = 0;

  /// Uncompressed bytes, as stated in the dataset.
  virtual std::uintmax_t size(const std::string& name) const = 0;

  /// Opens a file at its start. In a zip, reading damaged data throws UserError.
  virtual std::unique_ptr<std::istream> open(const std::string& name) const = 0;

  /// The name of a file for messages.
  virtual std::filesystem::path path_of(const std::string& name) const = 0;
};

std::unique_ptr<FilesInput> open_folder_input(const std::filesystem::path& folder);

/// The files are those in the folder that contains a file named `beside`: the top folder or any other. Compression:
/// none or deflate.
std::unique_ptr<FilesInput> open_zip_input(const std::filesystem::path& path, const std::string& beside);

}  // namespace esim::inline formats
