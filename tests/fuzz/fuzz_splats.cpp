// Reads arbitrary bytes from libFuzzer as a file of Gaussian splats, of the format that its content says, or .splat:
// the result is splats or a UserError, in bounded memory and time.
#include <cstdint>
#include <cstdlib>
#include <string>

#include "esim/core/error.h"
#include "esim/scene/splats/splat_file.h"
#include "named_memory.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const NamedMemory file("fuzz.splat");
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
