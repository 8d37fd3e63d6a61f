#pragma once

#include <filesystem>
#include <functional>
#include <numeric>
#include <optional>
#include <string>
#include <vector>

#include "esim/record/formats/hdf5_detail.h"

// Private to record/formats: includes hdf5.h.

namespace esim::hdf5 {

/// A dataset of items, counted by its first dimension, whose storage is known to hold as many as it says.
struct Column {
  /// How many numbers one item has.
  hsize_t item_numbers() const {
    return std::accumulate(item_shape.begin(), item_shape.end(), hsize_t{1}, std::multiplies<>());
  }

  Handle dataset;
  hsize_t size = 0;                   ///< items
  std::vector<hsize_t> item_shape{};  ///< of one item; empty: a number
  hsize_t chunk = 0;                  ///< items in a chunk; 0: not in chunks
  std::size_t number_bytes = 0;       ///< of one number in the file
  bool only_blosc = false;            ///< chunks are packed by Blosc and nothing else
};

/// An HDF5 file from anywhere: whatever is wrong with it is a UserError that names it.
class Input {
 public:
  explicit Input(std::filesystem::path path);

  hid_t id() const { return file_; }
  const std::filesystem::path& path() const { return path_; }

  bool has(const char* name) const;

  /// What is at the top, datasets and groups, for people: the first few of them.
  std::string contents() const;

  /// Checks rank and type, and that the file is large enough for what the dataset claims: damaged files ask for no
  /// memory and no loops beyond their own size.
  Column open_column(const char* name) const { return open(name, 0, true); }

  /// The same of items with so many dimensions, of integers or floating-point numbers, each item whole in a chunk.
  Column open_items(const char* name, std::size_t item_rank) const { return open(name, item_rank, false); }

  /// Fills `out` with whole items from the first-th on.
  template <typename T>
  void read(const Column& column, hsize_t first, std::span<T> out) const {
    read(column, first, out.size() / column.item_numbers(), native_type<T>(), out.data());
  }

  std::optional<std::int64_t> scalar(const char* name) const;
  std::optional<std::int64_t> integer_attribute(const char* name) const;
  std::optional<std::string> text_attribute(const char* name) const;

  /// Texts that belong to a dataset, as Output::create_text_attribute() writes them; none where there are none.
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

}  // namespace esim::hdf5
