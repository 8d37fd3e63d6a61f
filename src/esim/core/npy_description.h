#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace esim {

/// What the first bytes of a NumPy array file say (format versions 1 to 3).
struct NpyDescription {
  std::string type;                  ///< of the numbers, as NumPy writes it: "<f4"
  std::vector<std::uint64_t> shape;  ///< in C order: the last one runs fastest
};

/// Reads the dictionary of the header. Throws UserError, which names no file, where it is none, and for arrays in
/// Fortran order or of records.
NpyDescription parse_npy_description(std::string_view dictionary);

}  // namespace esim
