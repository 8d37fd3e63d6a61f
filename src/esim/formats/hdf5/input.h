#pragma once

#include <filesystem>
#include <functional>
#include <numeric>
#include <optional>
#include <string>
#include <vector>

#include "esim/formats/hdf5/library.h"

// Private to formats.
namespace esim::inline formats::hdf5 {

/// A dataset of items, counted by its first dimension. Its storage is known to hold the stated number of items.
struct Column {
  /// Numbers per item.
  hsize_t item_numbers() const {
    return std::accumulate(item_shape.begin(), item_shape.end(), hsize_t{1}, std::multiplies<>());
  }

  Handle dataset;
  hsize_t size = 0;                   ///< items
  std::vector<hsize_t> item_shape{};  ///< of one item; empty: a number
  hsize_t chunk = 0;                  ///< items per chunk; 0: not chunked
  std::size_t number_bytes = 0;       ///< of one number in the file
  bool only_blosc = false;            ///< chunks are compressed only by Blosc
};

/// An HDF5 file from any source. Any problem is a UserError that names the file.
class Input {
 public:
  explicit Input(std::filesystem::path path);

  hid_t id() const { return file_; }
  const std::filesystem::path& path() const { return path_; }

  bool has(const char* name) const;

  /// The first few datasets and groups at the top, as text.
  std::string contents() const;

  /// Checks rank, type, and that the file is large enough for the stated size of the dataset, so that damaged files
  /// cannot cause allocations or loops larger than themselves.
  Column open_column(const char* name) const { return open(name, 0, true); }

  /// The same for items of so many dimensions, of integers or floating-point numbers; each item must lie in one chunk.
  Column open_items(const char* name, std::size_t item_rank) const { return open(name, item_rank, false); }

  /// Fills `out` with complete items from index `first` on.
  template <typename T>
  void read(const Column& column, hsize_t first, std::span<T> out) const {
    read(column, first, out.size() / column.item_numbers(), native_type<T>(), out.data());
  }

  std::optional<std::int64_t> scalar(const char* name) const;
  std::optional<std::int64_t> integer_attribute(const char* name) const;
  std::optional<std::string> text_attribute(const char* name) const;

  /// Text attributes of a dataset, as Output::create_text_attribute() writes them; may be empty.
  std::vector<std::string> text_list_attribute(const Column& column, const char* name) const;

  [[noreturn]] void fail(const std::string& what) const;

 private:
  Column open(const char* name, std::size_t item_rank, bool integers) const;
  void read(const Column& column, hsize_t first, hsize_t count, hid_t type, void* out) const;
  void require_storage(const Column& column, const std::string& name) const;
  [[noreturn]] void fail_short(const Column& column, const std::string& name) const;
  void open_chunks(hid_t creation, Column& column, const std::string& name) const;
  void require_sound_chunks(const Column& column, hsize_t first, hsize_t count) const;

  std::filesystem::path path_;
  Handle file_;
};

}  // namespace esim::inline formats::hdf5
