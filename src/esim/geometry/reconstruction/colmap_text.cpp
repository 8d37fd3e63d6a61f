#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

#include "esim/core/error.h"
#include "esim/core/inputs/used_files.h"
#include "esim/geometry/reconstruction/colmap_models.h"

namespace esim::inline geometry {
namespace {

constexpr std::string_view kBlanks = " \t\r\v\f";

std::string_view trim(std::string_view text) {
  const std::size_t first = text.find_first_not_of(kBlanks);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kBlanks) - first + 1);
}

/// Takes the next word off a line; empty at its end.
std::string_view next_word(std::string_view& line) {
  line = trim(line);
  const std::string_view word = line.substr(0, line.find_first_of(kBlanks));
  line.remove_prefix(word.size());
  return word;
}

/// The lines of a text file, with their numbers.
class Lines {
 public:
  explicit Lines(const std::filesystem::path& file) : file_(file) {
    if (!in_) throw UserError(fmt::format("{}: cannot be read; check its permissions", file.string()));
  }

  [[noreturn]] void fail(const std::string& message) const {
    throw UserError(fmt::format("{}:{}: {}", file_.string(), number_, message));
  }

  /// The next line, even if it is blank; false at the end of the file.
  bool next(std::string_view& line) {
    if (!std::getline(in_, text_)) return false;
    ++number_;
    line = text_;
    if (number_ == 1 && line.starts_with("\xEF\xBB\xBF")) line.remove_prefix(3);  // byte order mark
    line = trim(line);
    return true;
  }

  /// The next line that is neither blank nor a comment.
  bool next_content(std::string_view& line) {
    while (next(line)) {
      if (!line.empty() && line.front() != '#') return true;
    }
    return false;
  }

  /// Takes a number off the line.
  template <typename T>
  T number(std::string_view& line, std::string_view name, std::string_view columns) const {
    const std::string_view word = next_word(line);
    if (word.empty()) fail(fmt::format("{} is missing; the line must be {}", name, columns));
    T value{};
    const auto [end, status] = std::from_chars(word.data(), word.data() + word.size(), value);
    bool valid = status == std::errc{} && end == word.data() + word.size();
    if constexpr (std::is_floating_point_v<T>) valid = valid && std::isfinite(value);
    if (!valid)
      fail(fmt::format("{} must be a {}, not '{}'; the line must be {}", name,
                       std::is_floating_point_v<T> ? "finite number" : "non-negative integer", word, columns));
    return value;
  }

  /// Calls body(), and completes its UserErrors with the line.
  template <typename Body>
  decltype(auto) here(const Body& body) const {
    try {
      return body();
    } catch (const UserError& error) {
      fail(error.what());
    }
  }

 private:
  std::filesystem::path file_;
  std::ifstream in_ = open_input(file_);
  std::string text_;
  std::size_t number_ = 0;
};

/// Whether a line can be the points of an image: numbers X Y POINT3D_ID, three for each point. Only its first and its
/// last word are read as numbers.
bool are_points(std::string_view line) {
  if (line.empty()) return true;
  std::size_t words = 0;
  bool blank = true;
  for (const char c : line) {
    const bool is_blank = kBlanks.find(c) != std::string_view::npos;
    if (blank && !is_blank) ++words;
    blank = is_blank;
  }
  const auto is_number = [](std::string_view word, auto value) {
    const auto [end, status] = std::from_chars(word.data(), word.data() + word.size(), value);
    return status == std::errc{} && end == word.data() + word.size();
  };
  const std::string_view last = line.substr(line.find_last_of(kBlanks) + 1);
  return words % 3 == 0 && is_number(next_word(line), double{}) && is_number(last, std::int64_t{});
}

}  // namespace

std::vector<ColmapCamera> read_colmap_cameras_text(const std::filesystem::path& file) {
  constexpr std::string_view kColumns = "CAMERA_ID MODEL WIDTH HEIGHT PARAMS...";
  Lines lines(file);
  std::vector<ColmapCamera> cameras;
  for (std::string_view line; lines.next_content(line);) {
    ColmapCamera camera;
    camera.id = lines.number<std::uint32_t>(line, "CAMERA_ID", kColumns);
    const std::string_view name = next_word(line);
    if (name.empty()) lines.fail(fmt::format("MODEL is missing; the line must be {}", kColumns));
    const ColmapModel& model = lines.here([&]() -> const ColmapModel& { return colmap_model(name); });
    camera.model = model.name;
    camera.width = static_cast<double>(lines.number<std::uint64_t>(line, "WIDTH", kColumns));
    camera.height = static_cast<double>(lines.number<std::uint64_t>(line, "HEIGHT", kColumns));
    while (!trim(line).empty()) camera.parameters.push_back(lines.number<double>(line, "a parameter", kColumns));
    if (camera.parameters.size() != model.parameters) {
      lines.fail(fmt::format("the model {} must have {} parameters, not {}; correct the line", model.name,
                             model.parameters, camera.parameters.size()));
    }
    cameras.push_back(std::move(camera));
  }
  return cameras;
}

std::vector<ColmapImage> read_colmap_images_text(const std::filesystem::path& file) {
  constexpr std::string_view kColumns = "IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME";
  constexpr std::array<std::string_view, 7> kPose{"QW", "QX", "QY", "QZ", "TX", "TY", "TZ"};
  Lines lines(file);
  std::vector<ColmapImage> images;
  for (std::string_view line; lines.next_content(line);) {
    const auto id = lines.number<std::uint32_t>(line, "IMAGE_ID", kColumns);
    std::array<double, kPose.size()> pose{};
    for (std::size_t i = 0; i < kPose.size(); ++i) pose[i] = lines.number<double>(line, kPose[i], kColumns);
    const auto camera_id = lines.number<std::uint32_t>(line, "CAMERA_ID", kColumns);
    const std::string name(trim(line));
    if (name.empty()) lines.fail(fmt::format("NAME is missing; the line must be {}", kColumns));
    images.push_back(lines.here([&] {
      return colmap_image(id, {pose[0], pose[1], pose[2], pose[3]}, {pose[4], pose[5], pose[6]}, camera_id, name);
    }));
    if (lines.next(line) && !are_points(line)) {
      lines.fail(
          "after the line of an image, its points must follow, X Y POINT3D_ID each; give a blank line if there are "
          "none");
    }
  }
  return images;
}

}  // namespace esim::inline geometry
