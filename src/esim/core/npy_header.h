#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

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

/// Fills as much as there is; returns how many bytes, fewer only at the end.
using Read = std::function<std::size_t(std::span<std::byte>)>;

/// Throws what the caller throws: it is told what is wrong with the file, "it ends within its header".
using Fail = std::function<void(const std::string& problem)>;

/// Reads the header, of versions 1 to 3, up to the first number.
Header read_header(const Read& read, const Fail& fail);

}  // namespace esim::npy
