#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "esim/files/input_file.h"

/// The header of NumPy's files (https://numpy.org/doc/stable/reference/generated/numpy.lib.format.html).
namespace esim::inline files::npy {

inline constexpr std::string_view kMagic = "\x93NUMPY";

/// The header of an array in C order. Its length does not depend on the shape, so that it can be overwritten when the
/// array has grown. `descr` is Python: "'<f4'".
std::string header_text(std::string_view descr, std::span<const std::uint64_t> shape);

/// A Python literal: a text, a word, or a sequence of literals. Dictionaries are sequences of keys and values in turn.
struct Literal {
  std::string text{};
  bool sequence = false;
  std::vector<Literal> items{};
};

/// The shape; nothing if the literal is not a sequence of natural numbers.
std::optional<std::vector<std::uint64_t>> shape_of(const Literal& literal);

struct Header {
  Literal descr{};  ///< the type of the items
  bool fortran_order = false;
  std::vector<std::uint64_t> shape{};
};

/// Throws the caller's exception; `problem` says what is wrong with the file: "it ends within its header".
using Fail = std::function<void(const std::string& problem)>;

/// Reads a header of version 1 to 3, up to the first number.
Header read_header(const Read& read, const Fail& fail);

}  // namespace esim::inline files::npy
