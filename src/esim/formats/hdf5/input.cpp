#include "esim/formats/hdf5/input.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <fstream>

#include "esim/core/error.h"
#include "esim/files/number_text.h"
#include "esim/files/output_file.h"

namespace esim::inline formats::hdf5 {
namespace {

constexpr hsize_t kMaxChunkNumbers = hsize_t{1} << 25;
constexpr std::size_t kMaxTextBytes = 256;
constexpr hssize_t kMaxTexts = 1 << 16;
constexpr std::size_t kBloscHead = 16;

bool is_integer(hid_t type) { return H5Tget_class(type) == H5T_INTEGER && H5Tget_size(type) <= 8; }

}  // namespace

Input::Input(std::filesystem::path path) : path_(std::move(path)) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(path_, error)) {
    fail(error ? error.message() : "it does not exist or is not a file");
  }
  if (!std::ifstream(path_)) fail(system_reason(errno));
  const Quiet quiet;
  register_blosc();
  file_ = Handle(H5Fopen(path_.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), H5Fclose);
  if (!file_.valid()) fail("it is not an HDF5 file, or it is damaged (" + last_error() + ")");
}

void Input::fail(const std::string& what) const { throw UserError("cannot read " + path_.string() + ": " + what); }

bool Input::has(const char* name) const {
  const Quiet quiet;
  // Checks each part of the name separately: the library fails below a group that does not exist.
  const std::string full = name;
  for (std::size_t slash = full.find('/'); slash != std::string::npos; slash = full.find('/', slash + 1)) {
    if (H5Lexists(file_, full.substr(0, slash).c_str(), H5P_DEFAULT) <= 0) return false;
  }
  return H5Lexists(file_, name, H5P_DEFAULT) > 0;
}

std::string Input::contents() const {
  constexpr hsize_t kMax = 100;
  const Quiet quiet;
  H5G_info_t group{};
  if (H5Gget_info(file_, &group) < 0) return "nothing that can be listed";
  std::vector<std::string> names;
  for (hsize_t i = 0; i < std::min(group.nlinks, kMax); ++i) {
    std::array<char, 64> name{};
    if (H5Lget_name_by_idx(file_, ".", H5_INDEX_NAME, H5_ITER_INC, i, name.data(), name.size(), H5P_DEFAULT) >= 0)
      names.emplace_back(name.data());
  }
  return names.empty() ? "nothing" : list_of_some(names);
}

Column Input::open(const char* name, std::size_t item_rank, bool integers) const {
  const Quiet quiet;
  if (!has(name)) fail(std::string("there is no dataset ") + name);
  Column column;
  column.dataset = Handle(H5Dopen2(file_, name, H5P_DEFAULT), H5Dclose);
  if (!column.dataset.valid()) fail(std::string(name) + " is not a readable dataset (" + last_error() + ")");
  const Handle type(H5Dget_type(column.dataset), H5Tclose);
  const Handle space(H5Dget_space(column.dataset), H5Sclose);
  if (integers && !is_integer(type)) fail(std::string(name) + " does not hold integers");
  if (!is_integer(type) && H5Tget_class(type) != H5T_FLOAT) fail(std::string(name) + " does not hold numbers");
  if (H5Sget_simple_extent_ndims(space) != static_cast<int>(item_rank + 1))
    fail(std::string(name) + (item_rank == 0 ? " does not have one dimension"
                                             : " does not have " + std::to_string(item_rank + 1) + " dimensions"));
  std::vector<hsize_t> shape(item_rank + 1);
  if (H5Sget_simple_extent_dims(space, shape.data(), nullptr) < 0) fail(last_error());
  column.size = shape[0];
  column.item_shape.assign(shape.begin() + 1, shape.end());
  column.number_bytes = H5Tget_size(type);
  hsize_t numbers = 1;
  for (const hsize_t extent : column.item_shape) {
    if (extent == 0 || __builtin_mul_overflow(numbers, extent, &numbers) || numbers > kMaxChunkNumbers)
      fail(std::string(name) + " has items of an unsupported size");
  }
  require_storage(column, name);
  const Handle creation(H5Dget_create_plist(column.dataset), H5Pclose);
  if (H5Pget_layout(creation) == H5D_CHUNKED) open_chunks(creation, column, name);
  return column;
}

void Input::require_storage(const Column& column, const std::string& name) const {
  const Handle creation(H5Dget_create_plist(column.dataset), H5Pclose);
  if (!creation.valid()) fail(name + ": " + last_error());
  if (H5Pget_external_count(creation) != 0) fail(name + " stores its data in another file, which is not supported");
  const H5D_layout_t layout = H5Pget_layout(creation);
  if (layout == H5D_CHUNKED) return;
  if (layout != H5D_CONTIGUOUS && layout != H5D_COMPACT) fail(name + " has an unsupported storage layout");
  std::error_code error;
  const std::uintmax_t file_bytes = std::filesystem::file_size(path_, error);
  if (column.size > file_bytes / column.item_numbers() ||
      H5Dget_storage_size(column.dataset) < column.size * column.item_numbers()) {
    fail_short(column, name);
  }
}

void Input::open_chunks(hid_t creation, Column& column, const std::string& name) const {
  std::vector<hsize_t> shape(column.item_shape.size() + 1);
  const int rank = static_cast<int>(shape.size());
  if (H5Pget_chunk(creation, rank, shape.data()) != rank) fail(name + ": " + last_error());
  column.chunk = shape[0];
  if (column.chunk == 0 || column.chunk > kMaxChunkNumbers / column.item_numbers()) {
    fail(name + " has chunks of " + std::to_string(column.chunk) + (rank == 1 ? " numbers" : " items") +
         ", which is more than is supported");
  }
  if (!std::equal(column.item_shape.begin(), column.item_shape.end(), shape.begin() + 1))
    fail(name + " has chunks that hold only parts of items, which is not supported");
  const int filters = H5Pget_nfilters(creation);
  for (int i = 0; i < filters; ++i) {
    unsigned flags = 0;
    std::size_t values = 0;
    const H5Z_filter_t filter =
        H5Pget_filter2(creation, static_cast<unsigned>(i), &flags, &values, nullptr, 0, nullptr, nullptr);
    if (filter == kBloscFilter && values < 4) fail(name + " has a damaged description of its compression filter");
    column.only_blosc = filter == kBloscFilter && filters == 1;
  }
  hsize_t chunks = 0;
  const Handle space(H5Dget_space(column.dataset), H5Sclose);
  if (column.size > 0 && H5Dget_num_chunks(column.dataset, space, &chunks) < 0) fail(name + ": " + last_error());
  if (column.size > 0 && chunks <= (column.size - 1) / column.chunk) fail_short(column, name);
}

void Input::fail_short(const Column& column, const std::string& name) const {
  fail(name + " should hold " + std::to_string(column.size) + " numbers, but the file has fewer");
}

// The sizes in the header of each compressed chunk must agree with the file before the filter allocates memory for it.
void Input::require_sound_chunks(const Column& column, hsize_t first, hsize_t count) const {
  if (!column.only_blosc) return;
  std::vector<std::uint8_t> packed;
  for (hsize_t chunk = first / column.chunk; chunk <= (first + count - 1) / column.chunk; ++chunk) {
    std::vector<hsize_t> offset(column.item_shape.size() + 1);
    offset[0] = chunk * column.chunk;
    hsize_t bytes = 0;
    if (H5Dget_chunk_storage_size(column.dataset, offset.data(), &bytes) < 0) fail(last_error());
    const std::size_t chunk_bytes = column.chunk * column.item_numbers() * column.number_bytes;
    bool sound = bytes > 0 && bytes <= chunk_bytes + kBloscHead;
    if (sound) {
      packed.resize(std::max<std::size_t>(bytes, kBloscHead));
      std::uint32_t skipped_filters = 0;
      if (H5Dread_chunk(column.dataset, H5P_DEFAULT, offset.data(), &skipped_filters, packed.data()) < 0)
        fail(last_error());
      std::uint32_t unpacked_bytes = 0, packed_bytes = 0;  // both little-endian
      std::memcpy(&unpacked_bytes, &packed[4], sizeof(unpacked_bytes));
      std::memcpy(&packed_bytes, &packed[12], sizeof(packed_bytes));
      sound = skipped_filters != 0 ? bytes == chunk_bytes : unpacked_bytes == chunk_bytes && packed_bytes == bytes;
    }
    if (!sound) fail("the compressed data from number " + std::to_string(offset[0]) + " on are damaged");
  }
}

void Input::read(const Column& column, hsize_t first, hsize_t count, hid_t type, void* out) const {
  if (count == 0) return;
  const Quiet quiet;
  require_sound_chunks(column, first, count);
  const Handle in_file(H5Dget_space(column.dataset), H5Sclose);
  std::vector<hsize_t> start(column.item_shape.size() + 1), shape = column.item_shape;
  start[0] = first;
  shape.insert(shape.begin(), count);
  const Handle in_memory(H5Screate_simple(static_cast<int>(shape.size()), shape.data(), nullptr), H5Sclose);
  if (H5Sselect_hyperslab(in_file, H5S_SELECT_SET, start.data(), nullptr, shape.data(), nullptr) < 0 ||
      H5Dread(column.dataset, type, in_memory, in_file, H5P_DEFAULT, out) < 0) {
    const std::string reason = last_error();
    fail("it is damaged, or compressed by a filter that is not available (" + reason + ")");
  }
}

std::optional<std::int64_t> Input::scalar(const char* name) const {
  if (!has(name)) return std::nullopt;
  const Quiet quiet;
  const Handle dataset(H5Dopen2(file_, name, H5P_DEFAULT), H5Dclose);
  if (!dataset.valid()) fail(std::string(name) + " is not a readable dataset (" + last_error() + ")");
  const Handle type(H5Dget_type(dataset), H5Tclose);
  const Handle space(H5Dget_space(dataset), H5Sclose);
  std::int64_t value = 0;
  if (!is_integer(type) || H5Sget_simple_extent_npoints(space) != 1 ||
      H5Dread(dataset, H5T_NATIVE_INT64, H5S_ALL, H5S_ALL, H5P_DEFAULT, &value) < 0) {
    fail(std::string(name) + " must be one integer");
  }
  return value;
}

std::optional<std::int64_t> Input::integer_attribute(const char* name) const {
  const Quiet quiet;
  if (H5Aexists(file_, name) <= 0) return std::nullopt;
  const Handle attribute(H5Aopen(file_, name, H5P_DEFAULT), H5Aclose);
  if (!attribute.valid()) fail(std::string("attribute ") + name + ": " + last_error());
  const Handle type(H5Aget_type(attribute), H5Tclose);
  const Handle space(H5Aget_space(attribute), H5Sclose);
  std::int64_t value = 0;
  if (!is_integer(type) || H5Sget_simple_extent_npoints(space) != 1 ||
      H5Aread(attribute, H5T_NATIVE_INT64, &value) < 0) {
    fail(std::string("attribute ") + name + " must be one integer");
  }
  return value;
}

std::optional<std::string> Input::text_attribute(const char* name) const {
  const Quiet quiet;
  if (H5Aexists(file_, name) <= 0) return std::nullopt;
  const Handle attribute(H5Aopen(file_, name, H5P_DEFAULT), H5Aclose);
  if (!attribute.valid()) fail(std::string("attribute ") + name + ": " + last_error());
  const Handle type(H5Aget_type(attribute), H5Tclose);
  const Handle space(H5Aget_space(attribute), H5Sclose);
  const std::size_t size = H5Tget_size(type);
  if (H5Tget_class(type) != H5T_STRING || H5Tis_variable_str(type) != 0 || size > kMaxTextBytes ||
      H5Sget_simple_extent_npoints(space) != 1) {
    fail(std::string("attribute ") + name + " must be a short text");
  }
  std::string text(size, '\0');
  if (H5Aread(attribute, type, text.data()) < 0) fail(std::string("attribute ") + name + ": " + last_error());
  text.resize(std::min(text.size(), text.find('\0')));
  return text;
}

std::vector<std::string> Input::text_list_attribute(const Column& column, const char* name) const {
  const Quiet quiet;
  if (H5Aexists(column.dataset, name) <= 0) return {};
  const Handle attribute(H5Aopen(column.dataset, name, H5P_DEFAULT), H5Aclose);
  if (!attribute.valid()) fail(std::string("attribute ") + name + ": " + last_error());
  const Handle type(H5Aget_type(attribute), H5Tclose);
  const Handle space(H5Aget_space(attribute), H5Sclose);
  const std::size_t size = H5Tget_size(type);
  const hssize_t count = H5Sget_simple_extent_npoints(space);
  if (H5Tget_class(type) != H5T_STRING || H5Tis_variable_str(type) != 0 || size > kMaxTextBytes || count < 0 ||
      count > kMaxTexts) {
    fail(std::string("attribute ") + name + " must be a list of short texts");
  }
  std::string cells(size * static_cast<std::size_t>(count), '\0');
  if (H5Aread(attribute, type, cells.data()) < 0) fail(std::string("attribute ") + name + ": " + last_error());
  std::vector<std::string> texts;
  for (std::size_t at = 0; at < cells.size(); at += size) {
    const std::string cell = cells.substr(at, size);
    texts.push_back(cell.substr(0, cell.find('\0')));
  }
  return texts;
}

}  // namespace esim::inline formats::hdf5
