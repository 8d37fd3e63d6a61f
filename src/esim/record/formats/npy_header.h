#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "esim/record/input_file.h"

/// The head of NumPy's files (https://numpy.org/doc/stable/reference/generated/numpy.lib.format.html).
namespace esim::npy {

inline constexpr std::string_view kMagic = "\x93NUMPY";

/// What stands before the numbers, in C order. As long for any extents, so that it can be replaced when the array has
/// grown. `descr` is Python: "'<f4'".
std::string header_text(std::string_view descr, std::span<const std::uint64_t> shape);

/// A Python literal: a text, a word, or a sequence of literals. Of dictionaries, keys and values in turn.
struct Literal {
  std::string text{};
  bool sequence = false;
  std::vector<Literal> items{};
};

/// Extents; nothing where it is no sequence of natural numbers.
std::optional<std::vector<std::uint64_t>> shape_of(const Literal& literal);

struct Header {
  Literal descr{};  ///< the type of the items
  bool fortran_order = false;
  std::vector<std::uint64_t> shape{};
};

/// Fills as much as there is; returns how many bytes, fewer only at the end. Throws UserError where they cannot be
/// read.
using Read = std::function<std::size_t(std::span<std::byte>)>;

/// Is a Read of a file.
std::size_t read_some(InputFile& file, std::span<std::byte> out);

/// Reads the header, of versions 1 to 3, up to the first number. Throws UserError in the name of the file where it is
/// none.
Header read_header(std::string_view name, const Read& read);

}  // namespace esim::npy
