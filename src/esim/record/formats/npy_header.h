#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>

#include "esim/core/npy_description.h"
#include "esim/record/input_file.h"

namespace esim {

/// The header of a NumPy array file, version 1.0, in C order, always of 128 bytes, so that it can be replaced when the
/// array has grown. `type` as NumPy writes it: "<f4".
std::string npy_header(std::string_view type, std::span<const std::uint64_t> shape);

/// Reads the header of versions 1 to 3, up to the first number. Fails for Fortran order and for structured arrays.
NpyDescription read_npy_header(InputFile& file);

}  // namespace esim
