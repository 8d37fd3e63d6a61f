#include "esim/formats/hdf5/library.h"

#include <algorithm>
#include <array>

#include "esim/core/error.h"
#include "esim/files/output_file.h"

namespace esim::inline formats::hdf5 {
namespace {

// Evictions would write parts of the index at any time. Without them, the file changes its structure only in flush(),
// so a killed process leaves the state of its last flush. The index is small: about 40 bytes per chunk.
herr_t hold_index_until_flush(hid_t access_list) {
  H5AC_cache_config_t config{};
  config.version = H5AC__CURR_CACHE_CONFIG_VERSION;
  if (H5Pget_mdc_config(access_list, &config) < 0) return -1;
  config.incr_mode = H5C_incr__off;
  config.flash_incr_mode = H5C_flash_incr__off;
  config.decr_mode = H5C_decr__off;
  config.evictions_enabled = false;
  return H5Pset_mdc_config(access_list, &config);
}

// A shuffle before the codec: the high bytes of neighbouring numbers are similar. Bits of integers are shuffled by
// Blosc, which takes two thirds of the time of bytes and gives smaller files; floating-point numbers are larger and
// slower with it.
herr_t add_filters(hid_t creation_list, Compression compression, hid_t type) {
  switch (compression) {
    case Compression::blosc: {
      // Four values are reserved for the filter, then level, shuffle (1: bytes, 2: bits), codec (5: Zstd).
      const unsigned shuffle = H5Tget_class(type) == H5T_INTEGER ? 2 : 1;
      const std::array<unsigned, 7> options = {0, 0, 0, 0, 1, shuffle, 5};
      return H5Pset_filter(creation_list, kBloscFilter, H5Z_FLAG_OPTIONAL, options.size(), options.data());
    }
    case Compression::gzip:
      return H5Pset_shuffle(creation_list) < 0 ? -1 : H5Pset_deflate(creation_list, 4);
    case Compression::none:
      return 0;
  }
  return -1;
}

herr_t keep_first_message(unsigned depth, const H5E_error2_t* error, void* text) {
  if (depth == 0 && error->desc != nullptr) *static_cast<std::string*>(text) = error->desc;
  return 0;
}

}  // namespace

template <>
hid_t native_type<std::int8_t>() {
  return H5T_NATIVE_INT8;
}
template <>
hid_t native_type<std::uint8_t>() {
  return H5T_NATIVE_UINT8;
}
template <>
hid_t native_type<std::uint16_t>() {
  return H5T_NATIVE_UINT16;
}
template <>
hid_t native_type<std::uint32_t>() {
  return H5T_NATIVE_UINT32;
}
template <>
hid_t native_type<std::uint64_t>() {
  return H5T_NATIVE_UINT64;
}
template <>
hid_t native_type<std::int64_t>() {
  return H5T_NATIVE_INT64;
}
template <>
hid_t native_type<float>() {
  return H5T_NATIVE_FLOAT;
}
template <>
hid_t native_type<double>() {
  return H5T_NATIVE_DOUBLE;
}

Quiet::Quiet() {
  H5Eget_auto2(H5E_DEFAULT, &print_, &data_);
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
}

Quiet::~Quiet() {
  H5Eset_auto2(H5E_DEFAULT, print_, data_);
  // Errors that a thread leaves on the error stack when it ends would keep the library from closing.
  if (print_ != nullptr) H5Eclear2(H5E_DEFAULT);
}

std::string last_error() {
  std::string text = "no further information";
  H5Ewalk2(H5E_DEFAULT, H5E_WALK_UPWARD, keep_first_message, &text);
  for (char& c : text) {
    if (c == '\n') c = ' ';
  }
  return text;
}

Output::Output(std::filesystem::path path) : path_(std::move(path)) {
  const Quiet quiet;
  register_blosc();
  const Handle creation(H5Pcreate(H5P_FILE_CREATE), H5Pclose);
  check(H5Pset_obj_track_times(creation, false));
  const Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
  check(set_output_driver(access, state_));
  check(hold_index_until_flush(access));
  check(H5Pset_fclose_degree(access, H5F_CLOSE_STRONG));
  file_ = Handle(H5Fcreate(path_.c_str(), H5F_ACC_TRUNC, creation, access), H5Fclose);
  check(static_cast<hid_t>(file_));
}

void Output::close() {
  if (!file_.valid()) return;
  const Quiet quiet;
  state_.durable = true;
  flush();
  file_.reset();
  check(0);
}

void Output::abandon() noexcept {
  if (!file_.valid()) return;
  const Quiet quiet;
  file_.reset();
}

void Output::fail(bool by_library) const {
  const std::string reason = by_library && state_.error == 0 ? last_error() : system_reason(state_.error);
  throw_cannot_write(path_, reason);
}

Handle Output::create_group(const char* name) const {
  const Handle creation(H5Pcreate(H5P_GROUP_CREATE), H5Pclose);
  check(H5Pset_obj_track_times(creation, false));
  Handle group(H5Gcreate2(file_, name, H5P_DEFAULT, creation, H5P_DEFAULT), H5Gclose);
  check(static_cast<hid_t>(group));
  return group;
}

template <typename T>
Handle Output::create_attribute(hid_t object, const char* name, T value) const {
  const Handle space(H5Screate(H5S_SCALAR), H5Sclose);
  Handle attribute(H5Acreate2(object, name, native_type<T>(), space, H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
  check(static_cast<hid_t>(attribute));
  check(H5Awrite(attribute, native_type<T>(), &value));
  return attribute;
}
template Handle Output::create_attribute(hid_t, const char*, std::uint8_t) const;
template Handle Output::create_attribute(hid_t, const char*, std::uint32_t) const;

void Output::create_text_attribute(hid_t object, const char* name, const std::string& value) const {
  const Handle type(H5Tcopy(H5T_C_S1), H5Tclose);
  check(H5Tset_size(type, value.size() + 1));
  check(H5Tset_cset(type, H5T_CSET_UTF8));
  const Handle space(H5Screate(H5S_SCALAR), H5Sclose);
  const Handle attribute(H5Acreate2(object, name, type, space, H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
  check(static_cast<hid_t>(attribute));
  check(H5Awrite(attribute, type, value.c_str()));
}

void Output::create_text_attribute(hid_t object, const char* name, const std::vector<std::string>& values) const {
  std::size_t longest = 0;
  for (const std::string& value : values) longest = std::max(longest, value.size());
  std::string cells;  // of equal size, padded with zeros
  for (const std::string& value : values) cells += value + std::string(longest + 1 - value.size(), '\0');
  const Handle type(H5Tcopy(H5T_C_S1), H5Tclose);
  check(H5Tset_size(type, longest + 1));
  check(H5Tset_cset(type, H5T_CSET_UTF8));
  const hsize_t count = values.size();
  const Handle space(H5Screate_simple(1, &count, nullptr), H5Sclose);
  const Handle attribute(H5Acreate2(object, name, type, space, H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
  check(static_cast<hid_t>(attribute));
  check(H5Awrite(attribute, type, cells.data()));
}

void Output::create_scalar(const char* name, std::int64_t value) const {
  const Handle creation(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
  check(H5Pset_obj_track_times(creation, false));
  const Handle space(H5Screate(H5S_SCALAR), H5Sclose);
  const Handle dataset(H5Dcreate2(file_, name, H5T_STD_I64LE, space, H5P_DEFAULT, creation, H5P_DEFAULT), H5Dclose);
  check(static_cast<hid_t>(dataset));
  check(H5Dwrite(dataset, H5T_NATIVE_INT64, H5S_ALL, H5S_ALL, H5P_DEFAULT, &value));
}

Series::Series(const Output& file, const char* name, SeriesLayout layout)
    : file_(&file), item_shape_(std::move(layout.item_shape)) {
  std::vector<hsize_t> shape = {0}, limit = {H5S_UNLIMITED}, chunk = {layout.chunk_items};
  for (const hsize_t extent : item_shape_) {
    item_numbers_ *= extent;
    for (auto* extents : {&shape, &limit, &chunk}) extents->push_back(extent);
  }
  const int rank = static_cast<int>(shape.size());

  const Handle creation(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
  file.check(H5Pset_obj_track_times(creation, false));
  file.check(H5Pset_chunk(creation, rank, chunk.data()));
  file.check(add_filters(creation, layout.compression, layout.type));

  // Complete chunks bypass the chunk cache; a small cache holds the growing chunk of an uncompressed series.
  const Handle access(H5Pcreate(H5P_DATASET_ACCESS), H5Pclose);
  const std::size_t cache_bytes = layout.compression == Compression::none ? 1 << 16 : 0;
  file.check(H5Pset_chunk_cache(access, 11, cache_bytes, 1.0));

  const Handle space(H5Screate_simple(rank, shape.data(), limit.data()), H5Sclose);
  dataset_ = Handle(H5Dcreate2(file.id(), name, layout.type, space, H5P_DEFAULT, creation, access), H5Dclose);
  file.check(static_cast<hid_t>(dataset_));
}

void Series::append(const void* numbers, std::size_t count, hid_t type) {
  if (count == 0) return;
  std::vector<hsize_t> start = {items_}, size = {count / item_numbers_}, total = {items_ + size[0]};
  for (const hsize_t extent : item_shape_) {
    start.push_back(0);
    size.push_back(extent);
    total.push_back(extent);
  }
  file_->check(H5Dset_extent(dataset_, total.data()));
  const Handle in_file(H5Dget_space(dataset_), H5Sclose);
  file_->check(H5Sselect_hyperslab(in_file, H5S_SELECT_SET, start.data(), nullptr, size.data(), nullptr));
  const Handle in_memory(H5Screate_simple(static_cast<int>(size.size()), size.data(), nullptr), H5Sclose);
  file_->check(H5Dwrite(dataset_, type, in_memory, in_file, H5P_DEFAULT, numbers));
  items_ = total[0];
}

}  // namespace esim::inline formats::hdf5
