#pragma once

#include <cstdint>
#include <filesystem>
#include <istream>
#include <memory>
#include <optional>
#include <string>

namespace esim {

/// The files of a dataset: in a folder, or in a zip. Failures are UserErrors that name the file.
class FilesInput {
 public:
  virtual ~FilesInput() = default;

  virtual bool has(const std::string& name) const = 0;

  /// Bytes, unpacked, as the dataset claims.
  virtual std::uintmax_t size(const std::string& name) const = 0;

  /// From its start. In a zip, reading what is damaged throws UserError.
  virtual std::unique_ptr<std::istream> open(const std::string& name) const = 0;

  /// What to call a file in messages.
  virtual std::filesystem::path path_of(const std::string& name) const = 0;
};

std::unique_ptr<FilesInput> open_folder_input(const std::filesystem::path& folder);

/// Files are those of the folder that holds a file of the name `beside`, which is the top one or any other.
/// Compression: none or deflate.
std::unique_ptr<FilesInput> open_zip_input(const std::filesystem::path& path, const std::string& beside);

}  // namespace esim
