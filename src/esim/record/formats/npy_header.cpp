#include "esim/record/formats/npy_header.h"

#include <fmt/format.h>

#include <algorithm>

#include "esim/core/error.h"

namespace esim {
namespace {

constexpr std::string_view kMagic = "\x93NUMPY";
constexpr std::size_t kHeaderBytes = 128, kPrefixBytes = 10;

}  // namespace

std::string npy_header(std::string_view type, std::span<const std::uint64_t> shape) {
  std::string extents;
  for (const std::uint64_t extent : shape) extents += (extents.empty() ? "" : ", ") + std::to_string(extent);
  if (shape.size() == 1) extents += ",";
  std::string text = fmt::format("{{'descr': '{}', 'fortran_order': False, 'shape': ({}), }}", type, extents);
  text.resize(kHeaderBytes - kPrefixBytes - 1, ' ');
  std::string header(kMagic);
  header += {'\x01', '\x00', static_cast<char>(kHeaderBytes - kPrefixBytes), '\x00'};
  return header + text + "\n";
}

NpyDescription read_npy_header(InputFile& file) {
  constexpr std::size_t kMaxBytes = 1 << 16;
  const auto prefix = file.read_exactly(kMagic.size() + 2, "the header");
  if (!std::equal(kMagic.begin(), kMagic.end(), reinterpret_cast<const char*>(prefix.data())))
    file.fail(0, "it is no NumPy array file");
  const std::size_t length_bytes = prefix[kMagic.size()] == std::byte{1} ? 2 : 4;
  std::size_t length = 0;
  const auto digits = file.read_exactly(length_bytes, "the header");
  for (std::size_t i = 0; i < length_bytes; ++i) length |= std::to_integer<std::size_t>(digits[i]) << 8 * i;
  if (length > kMaxBytes) file.fail(kMagic.size() + 2, fmt::format("a header of {} bytes is none", length));
  const auto bytes = file.read_exactly(length, "the header");
  try {
    return parse_npy_description({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
  } catch (const UserError& error) {
    file.fail(0, error.what());
  }
}

}  // namespace esim
