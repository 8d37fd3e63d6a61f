#pragma once

#include <sys/mman.h>
#include <unistd.h>

#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <string>

/// A file in memory with a name, since readers know formats by the end of a name.
class NamedMemory {
 public:
  explicit NamedMemory(const std::string& file_name) : descriptor_(memfd_create("fuzz", MFD_CLOEXEC)) {
    std::string name = (std::filesystem::temp_directory_path() / "esim-fuzz-XXXXXX").string();
    if (descriptor_ < 0 || ::mkdtemp(name.data()) == nullptr) std::abort();
    folder_ = name;
    path_ = folder_ / file_name;
    std::filesystem::create_symlink("/proc/self/fd/" + std::to_string(descriptor_), path_);
  }
  ~NamedMemory() {
    std::filesystem::remove_all(folder_);
    ::close(descriptor_);
  }
  NamedMemory(const NamedMemory&) = delete;
  NamedMemory& operator=(const NamedMemory&) = delete;

  void write(const std::uint8_t* data, std::size_t size) const {
    if (::ftruncate(descriptor_, 0) != 0 || ::pwrite(descriptor_, data, size, 0) != static_cast<ssize_t>(size))
      std::abort();
  }
  const std::filesystem::path& path() const { return path_; }

 private:
  int descriptor_;
  std::filesystem::path folder_, path_;
};
