#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>

#include "esim/files/input_file.h"

namespace esim::inline formats {

/// The files of a dataset, in a folder or a zip. Failures are UserErrors that name the file.
class FilesInput {
 public:
  virtual ~FilesInput() = default;

  virtual bool has(const std::string& name) const = 0;

  /// Uncompressed bytes, as stated in the dataset.
  virtual std::uintmax_t size(const std::string& name) const = 0;

  /// Opens a file at its start. In a zip, reading damaged data throws UserError.
  virtual Read open(const std::string& name) const = 0;

  /// The name of a file for messages.
  virtual std::filesystem::path path_of(const std::string& name) const = 0;
};

std::unique_ptr<FilesInput> open_folder_input(const std::filesystem::path& folder);

/// The files are those in the folder that contains a file named `beside`: the top folder or any other.
std::unique_ptr<FilesInput> open_zip_input(const std::filesystem::path& path, const std::string& beside);

}  // namespace esim::inline formats
