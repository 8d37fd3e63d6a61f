#pragma once

#include <hdf5.h>

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "esim/formats/hdf5/extensions/blosc_filter.h"
#include "esim/formats/hdf5/extensions/output_driver.h"
#include "esim/recording/compression.h"

// Private to formats: includes hdf5.h.
namespace esim::inline formats::hdf5 {

/// While it exists, the library prints nothing from this thread.
class Quiet {
 public:
  Quiet();
  ~Quiet();
  Quiet(const Quiet&) = delete;
  Quiet& operator=(const Quiet&) = delete;

 private:
  H5E_auto2_t print_ = nullptr;
  void* data_ = nullptr;
};

/// Owns an HDF5 identifier.
class Handle {
 public:
  using Close = herr_t (*)(hid_t);

  Handle() = default;
  Handle(hid_t id, Close close) : id_(id), close_(close) {}
  Handle(Handle&& other) noexcept : id_(std::exchange(other.id_, -1)), close_(other.close_) {}
  Handle& operator=(Handle&& other) noexcept {
    reset();
    id_ = std::exchange(other.id_, -1);
    close_ = other.close_;
    return *this;
  }
  ~Handle() { reset(); }

  operator hid_t() const { return id_; }
  bool valid() const { return id_ >= 0; }

  void reset() {
    if (id_ >= 0) close_(id_);
    id_ = -1;
  }

 private:
  hid_t id_ = -1;
  Close close_ = nullptr;
};

/// The innermost message of the library's last failing call in this thread.
std::string last_error();

template <typename T>
hid_t native_type();

/// A new HDF5 file. Its bytes do not depend on when or where it is written.
class Output {
 public:
  explicit Output(std::filesystem::path path);
  ~Output() { abandon(); }
  Output(const Output&) = delete;
  Output& operator=(const Output&) = delete;

  hid_t id() const { return file_; }
  const std::filesystem::path& path() const { return path_; }

  /// Returns a result of the library. Throws OutputError if it is an error or if the system refused a write.
  template <typename T>
  T check(T result) const {
    if (result < 0 || state_.error != 0) fail(result < 0);
    return result;
  }

  /// Hands everything to the system. From then on, the contents stay readable if this process is killed at any moment
  /// or the disk is full.
  void flush() { check(flush_in_order(file_, state_)); }

  /// Waits for the disk and closes. All series of this file must have been destroyed.
  void close();

  /// Closes in any state, silently.
  void abandon() noexcept;

  Handle create_group(const char* name) const;

  /// `object` is the file or a dataset.
  template <typename T>
  Handle create_attribute(hid_t object, const char* name, T value) const;
  void create_text_attribute(hid_t object, const char* name, const std::string& value) const;
  void create_text_attribute(hid_t object, const char* name, const std::vector<std::string>& values) const;
  void create_scalar(const char* name, std::int64_t value) const;

 private:
  [[noreturn]] void fail(bool by_library) const;

  std::filesystem::path path_;
  OutputState state_;
  Handle file_;
};

struct SeriesLayout {
  hid_t type = -1;                  ///< of the numbers in the file
  std::vector<hsize_t> item_shape;  ///< of one item; empty: a number
  hsize_t chunk_items = 1;
  Compression compression = Compression::none;
};

/// A dataset that grows along its first dimension. Each append() except the last should consist of whole chunks, so
/// that nothing is written twice. Without compression, any number of items is fine.
class Series {
 public:
  Series() = default;
  Series(const Output& file, const char* name, SeriesLayout layout);

  template <typename T>
  void append(std::span<const T> numbers) {
    append(numbers.data(), numbers.size(), native_type<T>());
  }
  hid_t id() const { return dataset_; }

 private:
  void append(const void* numbers, std::size_t count, hid_t type);

  const Output* file_ = nullptr;
  Handle dataset_;
  std::vector<hsize_t> item_shape_;
  hsize_t item_numbers_ = 1;
  hsize_t items_ = 0;
};

}  // namespace esim::inline formats::hdf5
