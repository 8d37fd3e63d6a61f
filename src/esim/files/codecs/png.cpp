#include <png.h>

#include <bit>
#include <csetjmp>
#include <cstring>
#include <new>

#include "esim/files/codecs/decoders.h"
#include "esim/files/codecs/image_codecs.h"

namespace esim::inline files {
namespace {

// libpng reports errors by longjmp(). Functions that it may leave_png this way own nothing.
[[noreturn]] void leave_png(png_structp png, png_const_charp) { png_longjmp(png, 1); }
void ignore_png_warning(png_structp, png_const_charp) {}

void read_png_bytes(png_structp png, png_bytep to, std::size_t count) {
  auto& rest = *static_cast<std::span<const std::byte>*>(png_get_io_ptr(png));
  if (count > rest.size()) png_error(png, "cut off");
  std::memcpy(to, rest.data(), count);
  rest = rest.subspan(count);
}

void write_png_bytes(png_structp png, png_bytep from, std::size_t count) {
  static_cast<std::string*>(png_get_io_ptr(png))->append(reinterpret_cast<const char*>(from), count);
}

void flush_nothing(png_structp) {}

struct PngReader {
  png_structp png = png_create_read_struct(PNG_LIBPNG_VER_STRING, nullptr, leave_png, ignore_png_warning);
  png_infop info = png != nullptr ? png_create_info_struct(png) : nullptr;
  std::span<const std::byte> rest;

  explicit PngReader(std::span<const std::byte> file) : rest(file) {
    if (info == nullptr) throw std::bad_alloc();
    png_set_read_fn(png, &rest, read_png_bytes);
  }
  ~PngReader() { png_destroy_read_struct(&png, &info, nullptr); }
  PngReader(const PngReader&) = delete;
  PngReader& operator=(const PngReader&) = delete;
};

/// Requests grey or R G B with alpha, of 8 or 16 bits. Returns the number of channels.
int request_channels(const PngReader& reader) {
  const int type = png_get_color_type(reader.png, reader.info);
  const bool palette = type == PNG_COLOR_TYPE_PALETTE, grey = type == PNG_COLOR_TYPE_GRAY;
  const bool transparent =
      (type & PNG_COLOR_MASK_ALPHA) != 0 || (palette && png_get_valid(reader.png, reader.info, PNG_INFO_tRNS) != 0);
  if (palette) png_set_palette_to_rgb(reader.png);
  if (grey) png_set_expand_gray_1_2_4_to_8(reader.png);
  if (type == PNG_COLOR_TYPE_GRAY_ALPHA) png_set_gray_to_rgb(reader.png);
  if (palette && transparent) png_set_tRNS_to_alpha(reader.png);
  if (!transparent) png_set_strip_alpha(reader.png);
  if (std::endian::native == std::endian::little) png_set_swap(reader.png);
  return grey ? 1 : transparent ? 4 : 3;
}

bool read_png_image(const PngReader& reader, std::size_t file_bytes, ImagePixels& pixels) {
  png_read_info(reader.png, reader.info);
  const std::uint32_t width = png_get_image_width(reader.png, reader.info);
  const std::uint32_t height = png_get_image_height(reader.png, reader.info);
  if (!is_plausible(width, height, file_bytes)) return false;
  const int bits = png_get_bit_depth(reader.png, reader.info) == 16 ? 16 : 8;
  const int channels = request_channels(reader), passes = png_set_interlace_handling(reader.png);
  png_read_update_info(reader.png, reader.info);
  pixels.resize(static_cast<int>(width), static_cast<int>(height), channels, bits);
  if (png_get_rowbytes(reader.png, reader.info) != pixels.row_bytes) return false;
  for (int pass = 0; pass < passes; ++pass) {
    for (int y = 0; y < pixels.height; ++y) png_read_row(reader.png, pixels.row(y), nullptr);
  }
  png_read_end(reader.png, nullptr);
  return true;
}

struct PngWriter {
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, leave_png, ignore_png_warning);
  png_infop info = png != nullptr ? png_create_info_struct(png) : nullptr;
  std::string bytes;

  PngWriter() {
    if (info == nullptr) throw std::bad_alloc();
    png_set_write_fn(png, &bytes, write_png_bytes, flush_nothing);
  }
  ~PngWriter() { png_destroy_write_struct(&png, &info); }
  PngWriter(const PngWriter&) = delete;
  PngWriter& operator=(const PngWriter&) = delete;
};

void write_png_image(const PngWriter& writer, const PixelView& image, PngEffort effort) {
  constexpr int kRuns = 3, kDefault = 0, kFastest = 1, kSmaller = 3;  // of zlib
  if (effort == PngEffort::fast) {
    png_set_filter(writer.png, PNG_FILTER_TYPE_BASE, PNG_FILTER_SUB);
    png_set_compression_level(writer.png, kFastest);
    png_set_compression_strategy(writer.png, kRuns);
  } else {
    png_set_compression_level(writer.png, kSmaller);
    png_set_compression_strategy(writer.png, kDefault);
  }
  png_set_IHDR(writer.png, writer.info, static_cast<png_uint_32>(image.width), static_cast<png_uint_32>(image.height),
               image.bits, image.channels == 1 ? PNG_COLOR_TYPE_GRAY : PNG_COLOR_TYPE_RGB, PNG_INTERLACE_NONE,
               PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  png_write_info(writer.png, writer.info);
  if (image.bits == 16 && std::endian::native == std::endian::little) png_set_swap(writer.png);
  const auto* row = static_cast<png_const_bytep>(image.data);
  for (int y = 0; y < image.height; ++y, row += image.row_bytes) png_write_row(writer.png, row);
  png_write_end(writer.png, writer.info);
}

}  // namespace

bool decode_png(std::span<const std::byte> file, ImagePixels& pixels) {
  const PngReader reader(file);
  if (setjmp(png_jmpbuf(reader.png)) != 0) return false;
  return read_png_image(reader, file.size(), pixels);
}

std::string encode_png(const PixelView& image, PngEffort effort) {
  PngWriter writer;
  if (setjmp(png_jmpbuf(writer.png)) != 0) throw std::bad_alloc();  // nothing else fails in memory
  write_png_image(writer, image, effort);
  return std::move(writer.bytes);
}

}  // namespace esim::inline files
