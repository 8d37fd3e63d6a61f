#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "esim/record/formats/hdf5_detail.h"

// Private to record/formats: includes hdf5.h.

namespace esim::hdf5 {

/// A dataset of integers with one dimension, whose storage is known to hold as many as it says.
struct Column {
  Handle dataset;
  hsize_t size = 0;
  hsize_t chunk = 0;             ///< numbers in a chunk; 0: not in chunks
  std::size_t number_bytes = 0;  ///< of one number in the file
  bool only_blosc = false;       ///< chunks are packed by Blosc and nothing else
};

/// An HDF5 file from anywhere: whatever is wrong with it is a UserError that names it.
class Input {
 public:
  explicit Input(std::filesystem::path path);

  hid_t id() const { return file_; }
  const std::filesystem::path& path() const { return path_; }

  bool has(const char* name) const;

  /// Checks rank and type, and that the file is large enough for what the dataset claims: damaged files ask for no
  /// memory and no loops beyond their own size.
  Column open_column(const char* name) const;

  /// Reads [first, first + count) of a column into `out`.
  template <typename T>
  void read(const Column& column, hsize_t first, std::span<T> out) const {
    read(column, first, out.size(), native_type<T>(), out.data());
  }

  std::optional<std::int64_t> scalar(const char* name) const;
  std::optional<std::int64_t> integer_attribute(const char* name) const;
  std::optional<std::string> text_attribute(const char* name) const;

  [[noreturn]] void fail(const std::string& what) const;

 private:
  void read(const Column& column, hsize_t first, hsize_t count, hid_t type, void* out) const;
  void require_storage(const Column& column, const std::string& name) const;
  [[noreturn]] void fail_short(const Column& column, const std::string& name) const;
  void open_chunks(hid_t creation, Column& column, const std::string& name) const;
  void require_sound_chunks(const Column& column, hsize_t first, hsize_t count) const;

  std::filesystem::path path_;
  Handle file_;
};

}  // namespace esim::hdf5
