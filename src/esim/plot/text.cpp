#include "esim/plot/text.h"

#include <cairo-ft.h>
#include <cairo.h>
#include <ft2build.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <mutex>
#include <utility>
#include FT_FREETYPE_H

#include "esim/core/error.h"
#include "esim/plot/coverage.h"

extern "C" {
extern const unsigned char esim_font_begin[], esim_font_end[];  // font_file.S
}

namespace esim::inline plot {
namespace {

/// The number of bytes of the UTF-8 character at the beginning of `text`; 0 if its bytes are invalid, or if the
/// character is one that Cairo refuses.
std::size_t character_length(std::string_view text) {
  const auto byte = [&](std::size_t i) { return static_cast<std::uint8_t>(text[i]); };
  const std::uint8_t lead = byte(0);
  if (lead < 0x80) return lead == 0 ? 0 : 1;
  const std::size_t length = lead >= 0xf8 ? 0 : lead >= 0xf0 ? 4 : lead >= 0xe0 ? 3 : lead >= 0xc0 ? 2 : 0;
  if (length == 0 || length > text.size()) return 0;
  std::uint32_t code = lead & (0x7fU >> length);
  for (std::size_t i = 1; i < length; ++i) {
    if ((byte(i) & 0xc0) != 0x80) return 0;
    code = code << 6 | (byte(i) & 0x3fU);
  }
  constexpr std::array<std::uint32_t, 5> kSmallest = {0, 0, 0x80, 0x800, 0x10000};
  const bool is_surrogate = code >= 0xd800 && code < 0xe000;
  const bool is_noncharacter = (code >= 0xfdd0 && code < 0xfdf0) || (code & 0xfffe) == 0xfffe;
  return code < kSmallest[length] || code > 0x10ffff || is_surrogate || is_noncharacter ? 0 : length;
}

/// The text with a replacement character (U+FFFD) for each invalid byte, such as those of old file names.
std::string valid_utf8(std::string_view text) {
  std::string valid;
  while (!text.empty()) {
    const std::size_t length = character_length(text);
    valid += length == 0 ? std::string_view("\uFFFD") : text.substr(0, length);
    text.remove_prefix(std::max<std::size_t>(1, length));
  }
  return valid;
}

/// The font at any size. Fonts of Cairo may be used by one thread at a time.
class Font {
 public:
  Font() {
    FT_Library library = nullptr;
    FT_Face face = nullptr;
    if (FT_Init_FreeType(&library) != 0 ||
        FT_New_Memory_Face(library, esim_font_begin, esim_font_end - esim_font_begin, 0, &face) != 0 ||
        FT_Load_Char(face, 'H', FT_LOAD_NO_SCALE) != 0 || face->glyph->metrics.horiBearingY <= 0)
      throw Error("the font of figures, DejaVu Sans, cannot be used: build esim with an intact DejaVuSans.ttf");
    capital_height_ = static_cast<double>(face->glyph->metrics.horiBearingY) / face->units_per_EM;
    // Both live as long as the program.
    face_ = cairo_ft_font_face_create_for_ft_face(face, FT_LOAD_NO_HINTING | FT_LOAD_NO_BITMAP);
  }

  TextMask draw(const std::string& line, int height) {
    const std::lock_guard lock(mutex_);
    const auto prepare = [&](cairo_t* context) {
      cairo_set_font_face(context, face_);
      cairo_set_font_size(context, height / capital_height_);
      cairo_font_options_t* const options = cairo_font_options_create();
      cairo_font_options_set_hint_style(options, CAIRO_HINT_STYLE_NONE);
      cairo_font_options_set_hint_metrics(options, CAIRO_HINT_METRICS_OFF);
      cairo_set_font_options(context, options);
      cairo_font_options_destroy(options);
    };
    cairo_text_extents_t extents{};
    cover({0, 0, 1, 1}, [&](cairo_t* context) {
      prepare(context);
      cairo_text_extents(context, line.c_str(), &extents);
    });
    TextMask mask;
    mask.width = static_cast<int>(std::ceil(extents.x_advance));
    if (extents.width <= 0 || extents.height <= 0) return mask;
    mask.left = static_cast<int>(std::floor(extents.x_bearing));
    mask.top = static_cast<int>(std::floor(extents.y_bearing));
    const int right = static_cast<int>(std::ceil(extents.x_bearing + extents.width));
    const int bottom = static_cast<int>(std::ceil(extents.y_bearing + extents.height));
    // As outlines: glyphs would be rounded to whole pixels, which spaces them unevenly.
    mask.coverage = cover({mask.left, mask.top, right - mask.left, bottom - mask.top}, [&](cairo_t* context) {
      prepare(context);
      cairo_text_path(context, line.c_str());
      cairo_set_antialias(context, CAIRO_ANTIALIAS_BEST);
      cairo_fill(context);
    });
    return mask;
  }

 private:
  std::mutex mutex_;
  cairo_font_face_t* face_ = nullptr;
  double capital_height_ = 1;  // at size 1
};

}  // namespace

TextMask TextMask::turned() const {
  TextMask mask{Image<std::uint8_t>(coverage.height(), coverage.width()), top, -left - coverage.width(), width};
  for (int y = 0; y < coverage.height(); ++y) {
    for (int x = 0; x < coverage.width(); ++x) mask.coverage(y, coverage.width() - 1 - x) = coverage(x, y);
  }
  return mask;
}

const TextMask& draw_text(std::string_view line, int height) {
  static Font font;
  // Most lines of text are the same in many frames of a video.
  constexpr std::size_t kMaxCached = 512;
  thread_local std::map<std::pair<std::string, int>, TextMask> drawn;
  std::pair key(std::string(line), height);
  const auto found = drawn.find(key);
  if (found != drawn.end()) return found->second;
  if (drawn.size() >= kMaxCached) drawn.clear();
  TextMask mask = font.draw(valid_utf8(line), height);
  return drawn.emplace(std::move(key), std::move(mask)).first->second;
}

std::string superscript(int number) {
  constexpr std::array<const char*, 10> kDigits = {"⁰", "¹", "²", "³", "⁴", "⁵", "⁶", "⁷", "⁸", "⁹"};
  std::string text = number < 0 ? "⁻" : "";
  for (const char digit : std::to_string(std::abs(number))) text += kDigits[static_cast<std::size_t>(digit - '0')];
  return text;
}

}  // namespace esim::inline plot
