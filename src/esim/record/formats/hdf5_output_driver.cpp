#include "esim/record/formats/hdf5_output_driver.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <mutex>
#include <new>

namespace esim::hdf5 {
namespace {

/// What the access list carries, copied byte by byte.
struct DriverInfo {
  OutputState* state = nullptr;
};

struct DriverFile {
  H5FD_t base{};  // first: the library knows the file by this member
  int descriptor = -1;
  OutputState* state = nullptr;
  haddr_t end_of_addresses = 0;
  haddr_t end_of_file = 0;
  dev_t device = 0;
  ino_t inode = 0;

  void note_failure() {
    if (state->error == 0) state->error = errno != 0 ? errno : EIO;
  }
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
  info->state->error = 0;  // the library tries without O_CREAT first, which may have failed
  auto* file = new (std::nothrow) DriverFile;
  if (file == nullptr) {
    ::close(descriptor);
    return nullptr;
  }
  file->descriptor = descriptor;
  file->state = info->state;
  file->end_of_file = static_cast<haddr_t>(status.st_size);
  file->device = status.st_dev;
  file->inode = status.st_ino;
  return &file->base;
}

herr_t close_file(H5FD_t* base) {
  DriverFile* file = as_file(base);
  if (file->state->durable && ::fsync(file->descriptor) != 0) file->note_failure();
  if (::close(file->descriptor) != 0) file->note_failure();
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
    *features = H5FD_FEAT_AGGREGATE_METADATA | H5FD_FEAT_ACCUMULATE_METADATA | H5FD_FEAT_DATA_SIEVE |
                H5FD_FEAT_AGGREGATE_SMALLDATA | H5FD_FEAT_DEFAULT_VFD_COMPATIBLE;
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
  while (size > 0) {
    const ssize_t got = ::pread(file->descriptor, out, size, static_cast<off_t>(address));
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) return -1;
    if (got == 0) break;
    out += got;
    address += static_cast<haddr_t>(got);
    size -= static_cast<std::size_t>(got);
  }
  std::memset(out, 0, size);  // beyond the end of the file everything is zero
  return 0;
}

herr_t write_bytes(H5FD_t* base, H5FD_mem_t, hid_t, haddr_t address, std::size_t size, const void* buffer) {
  DriverFile* file = as_file(base);
  const auto* in = static_cast<const char*>(buffer);
  while (size > 0 && file->state->error == 0) {
    const ssize_t put = ::pwrite(file->descriptor, in, size, static_cast<off_t>(address));
    if (put < 0 && errno == EINTR) continue;
    if (put <= 0) {
      file->note_failure();
      break;
    }
    in += put;
    address += static_cast<haddr_t>(put);
    size -= static_cast<std::size_t>(put);
  }
  file->end_of_file = std::max(file->end_of_file, address + size);
  return 0;
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
#ifdef H5FD_CLASS_VERSION  // from HDF5 1.14 on, which refuses to register a class that does not state it
  driver.version = H5FD_CLASS_VERSION;
  driver.value = H5_VFD_RESERVED;  // the first that is not HDF5's own; 256 to 511 are free for unregistered drivers
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

}  // namespace esim::hdf5
