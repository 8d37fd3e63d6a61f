#include "esim/formats/hdf5/extensions/blosc_filter.h"

#include <blosc.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <stdexcept>
#include <utility>

// HDF5's Blosc filter, as its registration describes it (number 32001). The values of a dataset's filter: version of
// the filter, version of Blosc's format, bytes of a number, bytes of a chunk, level, shuffle, codec.
namespace esim::inline formats::hdf5 {
namespace {

enum Value : std::size_t {
  kFilterVersion,
  kFormatVersion,
  kNumberBytes,
  kChunkBytes,
  kLevel,
  kShuffle,
  kCodec,
  kValues
};
using Values = std::array<unsigned, kValues>;

/// Bytes that the HDF5 library allocated.
class Buffer {
 public:
  explicit Buffer(std::size_t bytes) : data_(H5allocate_memory(std::max<std::size_t>(bytes, 1), 0)) {}
  ~Buffer() { H5free_memory(data_); }
  Buffer(const Buffer&) = delete;
  Buffer& operator=(const Buffer&) = delete;

  void* data() const { return data_; }
  void swap(void*& other) { std::swap(data_, other); }

 private:
  void* data_;
};

/// Completes the values of a new dataset.
herr_t set_local(hid_t creation, hid_t type, hid_t) {
  constexpr unsigned kVersion = 2;
  unsigned flags = 0;
  Values values{};
  std::size_t count = values.size();
  if (H5Pget_filter_by_id2(creation, kBloscFilter, &flags, &count, values.data(), 0, nullptr, nullptr) < 0) return -1;
  std::array<hsize_t, H5S_MAX_RANK> chunk{};
  const int rank = H5Pget_chunk(creation, static_cast<int>(chunk.size()), chunk.data());
  const std::size_t item_bytes = H5Tget_size(type);
  if (rank < 0 || item_bytes == 0) return -1;
  std::size_t number_bytes = item_bytes;
  if (H5Tget_class(type) == H5T_ARRAY) {
    const hid_t number = H5Tget_super(type);
    number_bytes = H5Tget_size(number);
    H5Tclose(number);
  }
  std::size_t chunk_bytes = item_bytes;
  for (int i = 0; i < rank; ++i) chunk_bytes *= chunk[static_cast<std::size_t>(i)];
  values[kFilterVersion] = kVersion;
  values[kFormatVersion] = BLOSC_VERSION_FORMAT;
  values[kNumberBytes] = number_bytes > BLOSC_MAX_TYPESIZE ? 1 : static_cast<unsigned>(number_bytes);
  values[kChunkBytes] = static_cast<unsigned>(chunk_bytes);
  return H5Pmodify_filter(creation, kBloscFilter, flags, std::max<std::size_t>(count, kChunkBytes + 1), values.data());
}

/// 0 if Blosc does not make the chunk smaller: the library then stores it as it is.
std::size_t compress(std::size_t count, const unsigned* values, std::size_t bytes, std::size_t* size, void** data) {
  constexpr int kDefaultLevel = 5;
  const int level = count > kLevel ? static_cast<int>(values[kLevel]) : kDefaultLevel;
  const int shuffle = count > kShuffle ? static_cast<int>(values[kShuffle]) : BLOSC_SHUFFLE;
  const char* codec = BLOSC_BLOSCLZ_COMPNAME;
  if (count > kCodec && blosc_compcode_to_compname(static_cast<int>(values[kCodec]), &codec) < 0) return 0;
  Buffer packed(bytes);
  if (packed.data() == nullptr) return 0;
  const int packed_bytes =
      blosc_compress_ctx(level, shuffle, values[kNumberBytes], bytes, *data, packed.data(), bytes, codec, 0, 1);
  if (packed_bytes <= 0) return 0;
  packed.swap(*data);
  *size = bytes;
  return static_cast<std::size_t>(packed_bytes);
}

/// 0 if the chunk is damaged.
std::size_t decompress(std::size_t bytes, std::size_t* size, void** data) {
  std::size_t unpacked_bytes = 0;
  if (blosc_cbuffer_validate(*data, bytes, &unpacked_bytes) < 0) return 0;
  Buffer unpacked(unpacked_bytes);
  if (unpacked.data() == nullptr) return 0;
  if (blosc_decompress_ctx(*data, unpacked.data(), unpacked_bytes, 1) <= 0) return 0;
  unpacked.swap(*data);
  *size = unpacked_bytes;
  return unpacked_bytes;
}

std::size_t filter(unsigned flags, std::size_t count, const unsigned* values, std::size_t bytes, std::size_t* size,
                   void** data) {
  if ((flags & H5Z_FLAG_REVERSE) != 0) return decompress(bytes, size, data);
  return count > kChunkBytes ? compress(count, values, bytes, size, data) : 0;
}

}  // namespace

void register_blosc() {
  static const bool kRegistered = [] {
    const H5Z_class2_t description{H5Z_CLASS_T_VERS, kBloscFilter, 1, 1, "blosc", nullptr, set_local, filter};
    return H5Zregister(&description) >= 0;
  }();
  if (!kRegistered) throw std::runtime_error("the HDF5 library does not accept the Blosc filter");
}

}  // namespace esim::inline formats::hdf5
