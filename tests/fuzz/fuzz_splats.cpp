// Reads arbitrary bytes from libFuzzer as a file of Gaussian splats, of the format that its content says, or .splat:
// the result is splats or a UserError, in bounded memory and time.
#include <sys/mman.h>
#include <unistd.h>

#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <string>

#include "esim/core/error.h"
#include "esim/scene/splats/splat_file.h"

namespace {

namespace fs = std::filesystem;

/// A file in memory with a name, by which .splat is known.
class NamedMemory {
 public:
  NamedMemory() : descriptor_(memfd_create("fuzz", MFD_CLOEXEC)) {
    std::string name = (fs::temp_directory_path() / "esim-fuzz-XXXXXX").string();
    if (descriptor_ < 0 || ::mkdtemp(name.data()) == nullptr) std::abort();
    folder_ = name;
    fs::create_symlink("/proc/self/fd/" + std::to_string(descriptor_), path());
  }
  ~NamedMemory() {
    fs::remove_all(folder_);
    ::close(descriptor_);
  }
  NamedMemory(const NamedMemory&) = delete;
  NamedMemory& operator=(const NamedMemory&) = delete;

  void write(const std::uint8_t* data, std::size_t size) const {
    if (::ftruncate(descriptor_, 0) != 0 || ::pwrite(descriptor_, data, size, 0) != static_cast<ssize_t>(size))
      std::abort();
  }
  fs::path path() const { return folder_ / "fuzz.splat"; }

 private:
  int descriptor_;
  fs::path folder_;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const NamedMemory file;
  file.write(data, size);
  esim::is_splat_file(file.path());
  try {
    const esim::Splats splats = esim::load_splats(file.path(), [](const std::string&) {});
    const std::size_t count = splats.size();
    const bool whole = splats.deviations.size() == count && splats.rotations.size() == count &&
                       splats.opacities.size() == count && splats.harmonics.size() == count * splats.coefficients() * 3;
    if (count == 0 || !whole) std::abort();
  } catch (const esim::UserError&) {  // what a damaged file is meant to be
  }
  return 0;
}
