#include "esim/formats/hdf5/extensions/output_driver.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <mutex>
#include <new>

namespace esim::inline formats::hdf5 {

struct DriverFile {
  H5FD_t base{};  // must be first: the library accesses the file by this member
  int descriptor = -1;
  OutputState* state = nullptr;
  haddr_t end_of_addresses = 0;
  haddr_t end_of_file = 0;
  dev_t device = 0;
  ino_t inode = 0;
  haddr_t flushed = 0;  // end of the file at the last flush; nothing refers to data beyond it

  void note_failure() {
    if (state->error == 0) state->error = errno != 0 ? errno : EIO;
  }
  void put(haddr_t address, const char* bytes, std::size_t size);
  std::size_t get(haddr_t address, char* bytes, std::size_t size) const;
};

/// After a failed write, nothing more is written.
void DriverFile::put(haddr_t address, const char* bytes, std::size_t size) {
  while (size > 0 && state->error == 0) {
    const ssize_t put = ::pwrite(descriptor, bytes, size, static_cast<off_t>(address));
    if (put < 0 && errno == EINTR) continue;
    if (put <= 0) return note_failure();
    bytes += put;
    address += static_cast<haddr_t>(put);
    size -= static_cast<std::size_t>(put);
  }
}

/// The number of existing bytes, up to `size`; more than `size` on errors.
std::size_t DriverFile::get(haddr_t address, char* bytes, std::size_t size) const {
  std::size_t done = 0;
  while (done < size) {
    const ssize_t got = ::pread(descriptor, bytes + done, size - done, static_cast<off_t>(address + done));
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) return size + 1;
    if (got == 0) break;
    done += static_cast<std::size_t>(got);
  }
  return done;
}

namespace {

/// The data in the access list, copied byte by byte.
struct DriverInfo {
  OutputState* state = nullptr;
};

DriverFile* as_file(H5FD_t* file) { return reinterpret_cast<DriverFile*>(file); }
const DriverFile* as_file(const H5FD_t* file) { return reinterpret_cast<const DriverFile*>(file); }

H5FD_t* open_file(const char* name, unsigned flags, hid_t access_list, haddr_t) {
  const auto* info = static_cast<const DriverInfo*>(H5Pget_driver_info(access_list));
  if (info == nullptr) return nullptr;
  int mode = O_CLOEXEC | ((flags & H5F_ACC_RDWR) != 0 ? O_RDWR : O_RDONLY);
  if ((flags & H5F_ACC_TRUNC) != 0) mode |= O_TRUNC;
  if ((flags & H5F_ACC_CREAT) != 0) mode |= O_CREAT;
  if ((flags & H5F_ACC_EXCL) != 0) mode |= O_EXCL;
  const int descriptor = ::open(name, mode, 0666);
  struct stat status {};
  if (descriptor < 0 || ::fstat(descriptor, &status) != 0) {
    info->state->error = errno;
    if (descriptor >= 0) ::close(descriptor);
    return nullptr;
  }
  info->state->error = 0;  // the library first tries without O_CREAT, which may have failed
  auto* file = new (std::nothrow) DriverFile;
  if (file == nullptr) {
    ::close(descriptor);
    return nullptr;
  }
  file->descriptor = descriptor;
  file->state = info->state;
  file->state->file = file;
  file->end_of_file = static_cast<haddr_t>(status.st_size);
  file->device = status.st_dev;
  file->inode = status.st_ino;
  return &file->base;
}

herr_t close_file(H5FD_t* base) {
  DriverFile* file = as_file(base);
  if (file->state->durable && ::fsync(file->descriptor) != 0) file->note_failure();
  if (::close(file->descriptor) != 0) file->note_failure();
  file->state->file = nullptr;
  delete file;
  return 0;
}

int compare_files(const H5FD_t* a, const H5FD_t* b) {
  const DriverFile* left = as_file(a);
  const DriverFile* right = as_file(b);
  if (left->device != right->device) return left->device < right->device ? -1 : 1;
  if (left->inode != right->inode) return left->inode < right->inode ? -1 : 1;
  return 0;
}

herr_t query(const H5FD_t*, unsigned long* features) {
  if (features != nullptr) {
    // Metadata is not accumulated: each piece must arrive with its type, because flush_in_order() orders pieces by
    // type.
    *features = H5FD_FEAT_AGGREGATE_METADATA | H5FD_FEAT_DATA_SIEVE | H5FD_FEAT_AGGREGATE_SMALLDATA |
                H5FD_FEAT_DEFAULT_VFD_COMPATIBLE;
  }
  return 0;
}

haddr_t end_of_addresses(const H5FD_t* file, H5FD_mem_t) { return as_file(file)->end_of_addresses; }

herr_t set_end_of_addresses(H5FD_t* file, H5FD_mem_t, haddr_t address) {
  as_file(file)->end_of_addresses = address;
  return 0;
}

haddr_t end_of_file(const H5FD_t* file, H5FD_mem_t) { return as_file(file)->end_of_file; }

herr_t read_bytes(H5FD_t* base, H5FD_mem_t, hid_t, haddr_t address, std::size_t size, void* buffer) {
  const DriverFile* file = as_file(base);
  auto* out = static_cast<char*>(buffer);
  const std::size_t there = file->get(address, out, size);
  if (there > size) return -1;
  std::memset(out + there, 0, size - there);  // beyond the end of the file, everything is zero
  for (const HeldWrite& held : file->state->held) {
    const haddr_t first = std::max(address, held.address);
    const haddr_t last = std::min(address + size, held.address + held.bytes.size());
    if (first < last) std::memcpy(out + (first - address), held.bytes.data() + (first - held.address), last - first);
  }
  return 0;
}

herr_t write_bytes(H5FD_t* base, H5FD_mem_t type, hid_t, haddr_t address, std::size_t size, const void* buffer) {
  DriverFile* file = as_file(base);
  const auto* in = static_cast<const char*>(buffer);
  file->end_of_file = std::max(file->end_of_file, address + size);
  if (!file->state->holding) {
    file->put(address, in, size);
    return 0;
  }
  try {
    file->state->held.push_back({type, address, std::vector<char>(in, in + size)});
  } catch (const std::bad_alloc&) {
    if (file->state->error == 0) file->state->error = ENOMEM;
  }
  return 0;
}

/// The order of pieces that are already referred to: the superblock, which has the length of the file, before the
/// indices, and those before the headers, which have the lengths of the datasets.
int turn_of(H5FD_mem_t type) { return type == H5FD_MEM_SUPER ? 0 : type == H5FD_MEM_OHDR ? 2 : 1; }

void write_in_order(DriverFile& file, std::vector<HeldWrite>& writes) {
  const auto old = std::stable_partition(writes.begin(), writes.end(),
                                         [&](const HeldWrite& write) { return write.address >= file.flushed; });
  // A new file becomes valid with its superblock.
  std::stable_sort(writes.begin(), old, [](const HeldWrite& a, const HeldWrite& b) {
    return (a.type != H5FD_MEM_SUPER) > (b.type != H5FD_MEM_SUPER);
  });
  for (auto write = writes.begin(); write != old; ++write)
    file.put(write->address, write->bytes.data(), write->bytes.size());
  // A hole in the file needs room as well: its present content is written again.
  for (auto write = old; write != writes.end(); ++write) {
    std::vector<char> now(write->bytes.size());
    if (file.get(write->address, now.data(), now.size()) <= now.size())
      file.put(write->address, now.data(), now.size());
  }
  std::stable_sort(old, writes.end(),
                   [](const HeldWrite& a, const HeldWrite& b) { return turn_of(a.type) < turn_of(b.type); });
  for (auto write = old; write != writes.end(); ++write)
    file.put(write->address, write->bytes.data(), write->bytes.size());
  file.flushed = file.end_of_file;
}

herr_t truncate_file(H5FD_t* base, hid_t, hbool_t) {
  DriverFile* file = as_file(base);
  if (file->end_of_addresses == file->end_of_file) return 0;
  if (file->state->error == 0 && ::ftruncate(file->descriptor, static_cast<off_t>(file->end_of_addresses)) != 0) {
    file->note_failure();
  }
  file->end_of_file = file->end_of_addresses;
  return 0;
}

H5FD_class_t driver_class() {
  constexpr H5FD_mem_t kOneFreeListForMetadata[H5FD_MEM_NTYPES] = H5FD_FLMAP_DICHOTOMY;
  H5FD_class_t driver{};
#ifdef H5FD_CLASS_VERSION  // HDF5 1.14 and later refuse a class that does not state its version
  driver.version = H5FD_CLASS_VERSION;
  driver.value = H5_VFD_RESERVED;  // the first value not reserved by HDF5; 256 to 511 are free for unregistered drivers
#endif
  driver.name = "esim_output";
  driver.maxaddr = (haddr_t{1} << 62) - 1;
  driver.fc_degree = H5F_CLOSE_WEAK;
  driver.fapl_size = sizeof(DriverInfo);
  driver.open = open_file;
  driver.close = close_file;
  driver.cmp = compare_files;
  driver.query = query;
  driver.get_eoa = end_of_addresses;
  driver.set_eoa = set_end_of_addresses;
  driver.get_eof = end_of_file;
  driver.read = read_bytes;
  driver.write = write_bytes;
  driver.truncate = truncate_file;
  std::memcpy(driver.fl_map, kOneFreeListForMetadata, sizeof(driver.fl_map));
  return driver;
}

}  // namespace

herr_t flush_in_order(hid_t file, OutputState& state) {
  state.holding = true;
  const herr_t result = H5Fflush(file, H5F_SCOPE_GLOBAL);
  state.holding = false;
  if (result >= 0 && state.file != nullptr) write_in_order(*state.file, state.held);
  state.held.clear();
  return result;
}

herr_t set_output_driver(hid_t access_list, OutputState& state) {
  static const H5FD_class_t kClass = driver_class();
  static std::mutex mutex;
  static hid_t driver = -1;
  const std::lock_guard lock(mutex);
  if (driver < 0 || H5Iget_type(driver) != H5I_VFL) driver = H5FDregister(&kClass);
  if (driver < 0) return -1;
  const DriverInfo info{&state};
  return H5Pset_driver(access_list, driver, &info);
}

}  // namespace esim::inline formats::hdf5
