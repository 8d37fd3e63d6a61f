#include <csetjmp>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <new>

#include <jpeglib.h>  // needs cstdio

#include "esim/files/codecs/decoders.h"
#include "esim/files/codecs/image_codecs.h"

namespace esim::inline files {
namespace {

/// libjpeg reports errors by longjmp(). Functions that it may leave_jpeg this way own nothing.
struct JpegErrors : jpeg_error_mgr {
  std::jmp_buf start{};
};

[[noreturn]] void leave_jpeg(j_common_ptr state) { std::longjmp(static_cast<JpegErrors*>(state->err)->start, 1); }
void ignore_jpeg_message(j_common_ptr) {}
void ignore_jpeg_warning(j_common_ptr, int) {}

void set_jpeg_errors(JpegErrors& errors) {
  jpeg_std_error(&errors);
  errors.error_exit = leave_jpeg;
  errors.output_message = ignore_jpeg_message;
  errors.emit_message = ignore_jpeg_warning;
}

struct JpegReader {
  jpeg_decompress_struct state{};
  JpegErrors errors;

  JpegReader() {
    set_jpeg_errors(errors);
    state.err = &errors;
  }
  ~JpegReader() { jpeg_destroy_decompress(&state); }
  JpegReader(const JpegReader&) = delete;
  JpegReader& operator=(const JpegReader&) = delete;
};

/// Cyan, magenta, yellow and black, all inverted, as Adobe's programs write them.
void convert_inks(const std::uint8_t* inks, int width, std::uint8_t* rgb) {
  for (int x = 0; x < width; ++x, inks += 4, rgb += 3) {
    for (int c = 0; c < 3; ++c) rgb[c] = static_cast<std::uint8_t>(inks[3] - ((255 - inks[c]) * inks[3] >> 8));
  }
}

bool read_jpeg_image(JpegReader& reader, std::span<const std::byte> file, int factor, bool colour, ImagePixels& pixels,
                     std::vector<std::uint8_t>& inks) {
  jpeg_decompress_struct& state = reader.state;
  jpeg_create_decompress(&state);
  jpeg_mem_src(&state, reinterpret_cast<const unsigned char*>(file.data()), file.size());
  jpeg_read_header(&state, TRUE);
  if (!is_plausible(state.image_width, state.image_height, file.size())) return false;
  const bool in_inks = state.num_components == 4, grey = state.num_components == 1 && !colour;
  state.out_color_space = in_inks ? JCS_CMYK : grey ? JCS_GRAYSCALE : JCS_RGB;
  state.scale_num = 1;
  state.scale_denom = static_cast<unsigned>(factor);
  jpeg_start_decompress(&state);
  pixels.resize(static_cast<int>(state.output_width), static_cast<int>(state.output_height), grey ? 1 : 3, 8);
  inks.resize(in_inks ? 4 * std::size_t{state.output_width} : 0);
  while (state.output_scanline < state.output_height) {
    std::uint8_t* const row = pixels.row(static_cast<int>(state.output_scanline));
    JSAMPROW target = in_inks ? inks.data() : row;
    jpeg_read_scanlines(&state, &target, 1);
    if (in_inks) convert_inks(inks.data(), pixels.width, row);
  }
  jpeg_finish_decompress(&state);
  return true;
}

bool decode_any_jpeg(std::span<const std::byte> file, int factor, bool colour, ImagePixels& pixels) {
  JpegReader reader;
  std::vector<std::uint8_t> inks;
  if (setjmp(reader.errors.start) != 0) return false;
  return read_jpeg_image(reader, file, factor, colour, pixels, inks);
}

struct JpegWriter {
  jpeg_compress_struct state{};
  JpegErrors errors;
  unsigned char* bytes = nullptr;  // allocated by libjpeg
  unsigned long size = 0;

  JpegWriter() {
    set_jpeg_errors(errors);
    state.err = &errors;
  }
  ~JpegWriter() {
    jpeg_destroy_compress(&state);
    std::free(bytes);
  }
  JpegWriter(const JpegWriter&) = delete;
  JpegWriter& operator=(const JpegWriter&) = delete;
};

void write_jpeg_image(JpegWriter& writer, const PixelView& image, int quality) {
  jpeg_compress_struct& state = writer.state;
  jpeg_create_compress(&state);
  jpeg_mem_dest(&state, &writer.bytes, &writer.size);
  state.image_width = static_cast<JDIMENSION>(image.width);
  state.image_height = static_cast<JDIMENSION>(image.height);
  state.input_components = image.channels;
  state.in_color_space = image.channels == 1 ? JCS_GRAYSCALE : JCS_RGB;
  jpeg_set_defaults(&state);
  jpeg_set_quality(&state, quality, TRUE);
  jpeg_start_compress(&state, TRUE);
  while (state.next_scanline < state.image_height) {
    const auto* const row = static_cast<const unsigned char*>(image.data) + state.next_scanline * image.row_bytes;
    auto* line = const_cast<JSAMPROW>(row);
    jpeg_write_scanlines(&state, &line, 1);
  }
  jpeg_finish_compress(&state);
}

}  // namespace

bool decode_jpeg(std::span<const std::byte> file, ImagePixels& pixels) {
  return decode_any_jpeg(file, 1, false, pixels);
}

bool decode_reduced_jpeg(std::span<const std::byte> file, int factor, ImagePixels& pixels) {
  return decode_any_jpeg(file, factor, true, pixels);
}

std::string encode_jpeg(const PixelView& image, int quality) {
  JpegWriter writer;
  if (setjmp(writer.errors.start) != 0) throw std::bad_alloc();  // nothing else fails in memory
  write_jpeg_image(writer, image, quality);
  return {reinterpret_cast<const char*>(writer.bytes), writer.size};
}

}  // namespace esim::inline files
