// Reads arbitrary bytes from libFuzzer as a file of the format that the program's name names, fuzz_NAME: the result is
// records or a UserError, in bounded memory and time.
#include <sys/mman.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <string>

#include "esim/core/error.h"
#include "esim/formats/formats.h"
#include "esim/recording/checked_source.h"

namespace {

/// A file in memory, which has a path.
class MemoryFile {
 public:
  MemoryFile(const std::uint8_t* data, std::size_t size) : descriptor_(memfd_create("fuzz", MFD_CLOEXEC)) {
    if (descriptor_ < 0 || write(descriptor_, data, size) != static_cast<ssize_t>(size)) std::abort();
  }
  ~MemoryFile() { close(descriptor_); }
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;

  std::string path() const { return "/proc/self/fd/" + std::to_string(descriptor_); }

 private:
  int descriptor_;
};

const esim::Format* fuzzed = nullptr;

void read(const std::string& path, const esim::ReadOptions& options) {
  try {
    esim::CheckedSource source(fuzzed->open(path, options), path, options);
    while (source.next() != nullptr) {
    }
  } catch (const esim::UserError&) {  // what a damaged file is meant to be
  }
}

}  // namespace

extern "C" int LLVMFuzzerInitialize(int*, char*** arguments) {
  const std::string program = std::filesystem::path((*arguments)[0]).filename();
  fuzzed = &esim::format_named(program.substr(program.find('_') + 1));
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const MemoryFile file(data, size);
  esim::ReadOptions tolerant;
  tolerant.recover = [](const std::string&) {};
  read(file.path(), {});
  read(file.path(), tolerant);
  return 0;
}
