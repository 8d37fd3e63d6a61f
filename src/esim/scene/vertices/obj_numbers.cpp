#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <string_view>

#include "esim/scene/import/folder.h"
#include "esim/scene/vertices/mesh_formats.h"

namespace esim::inline scene {
namespace {

constexpr std::string_view kBlanks = " \t\r";

std::string_view next_word(std::string_view& line) {
  line.remove_prefix(std::min(line.find_first_not_of(kBlanks), line.size()));
  const std::string_view word = line.substr(0, line.find_first_of(kBlanks));
  line.remove_prefix(word.size());
  return word;
}

/// The text of an OBJ file, in which lines that go on after a backslash are joined.
std::string text_of(const std::filesystem::path& file) {
  const std::vector<std::byte> bytes = read_bytes(file);
  std::string text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  for (std::size_t at = text.find('\\'); at != std::string::npos; at = text.find('\\', at + 1)) {
    const std::size_t end = text.find_first_not_of('\r', at + 1);
    if (end != std::string::npos && text[end] == '\n')
      std::fill_n(text.begin() + static_cast<std::ptrdiff_t>(at), end + 1 - at, ' ');
  }
  return text;
}

/// Splits a text into lines.
class Lines {
 public:
  explicit Lines(std::string_view text) : rest_(text) {}

  /// The next line without its end; returns false after the last one.
  bool next(std::string_view& line) {
    if (rest_.empty()) return false;
    ++number_;
    line = rest_.substr(0, rest_.find('\n'));
    rest_.remove_prefix(std::min(line.size() + 1, rest_.size()));
    return true;
  }

  std::size_t number() const { return number_; }

 private:
  std::string_view rest_;
  std::size_t number_ = 0;
};

/// What stands behind a "v".
struct VertexLine {
  std::string_view coordinates;  ///< three words
  std::size_t words = 0;
};

VertexLine vertex_line(std::string_view rest) {
  rest.remove_prefix(std::min(rest.find_first_not_of(kBlanks), rest.size()));
  VertexLine line{rest};
  std::string_view after = rest;
  for (std::string_view word = next_word(after); !word.empty() && word.front() != '#'; word = next_word(after)) {
    if (++line.words == 3) line.coordinates = rest.substr(0, rest.size() - after.size());
  }
  return line;
}

class ObjReader {
 public:
  explicit ObjReader(const std::filesystem::path& file) : file_(file), text_(text_of(file)), lines_(text_) {}

  NumberedMesh read() {
    std::string_view line;
    while (lines_.next(line)) {
      const std::string_view key = next_word(line);
      if (key == "v") read_vertex(vertex_line(line));
      if (key == "f") read_face(line);
    }
    return std::move(mesh_);
  }

 private:
  [[noreturn]] void fail(const std::string& reason) const {
    fail_vertices(file_, fmt::format("line {}: {}; export it again", lines_.number(), reason));
  }

  void read_vertex(VertexLine line) {
    if (line.words != 3 && line.words < 6)  // 6: with a colour
      fail(fmt::format("a vertex must have 3 coordinates, not {}", line.words));
    Eigen::Vector3f& vertex = mesh_.vertices.emplace_back();
    for (float& coordinate : vertex.reshaped()) {
      std::string_view word = next_word(line.coordinates);
      if (word.starts_with('+')) word.remove_prefix(1);
      double value = 0;
      const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
      // Numbers too small for a double are 0.
      const bool tiny = error == std::errc::result_out_of_range && word.find('-', 1) != std::string_view::npos;
      if ((error != std::errc() && !tiny) || end != word.data() + word.size())
        fail(fmt::format("'{}' is not a coordinate", word));
      coordinate = tiny ? 0.0F : static_cast<float>(value);
    }
    check_vertex(file_, mesh_.vertices.size() - 1, vertex);
  }

  void read_face(std::string_view line) {
    std::vector<std::uint32_t> face;
    for (std::string_view word = next_word(line); !word.empty() && word.front() != '#'; word = next_word(line))
      face.push_back(number_of(word.substr(0, word.find('/'))));
    face.insert(face.begin(), static_cast<std::uint32_t>(face.size()));
    const std::size_t old = mesh_.faces.size(), added = face.size() * sizeof face[0];
    mesh_.faces.resize(old + added);
    std::memcpy(mesh_.faces.data() + old, face.data(), added);
  }

  /// The vertex from 0 of a number from 1, or from -1 backwards.
  std::uint32_t number_of(std::string_view word) const {
    std::int64_t number = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), number);
    const auto count = static_cast<std::int64_t>(mesh_.vertices.size());
    if (number < 0) number += count + 1;
    if (error != std::errc() || end != word.data() + word.size() || number < 1)
      fail(fmt::format("'{}' is not the number of a vertex", word));
    if (number > std::int64_t{UINT32_MAX}) fail(fmt::format("vertex {} of a face is missing", word));
    return static_cast<std::uint32_t>(number - 1);
  }

  const std::filesystem::path& file_;
  std::string text_;
  Lines lines_;
  NumberedMesh mesh_;
};

}  // namespace

NumberedMesh read_obj_numbers(const std::filesystem::path& file) { return ObjReader(file).read(); }

std::string numbered_obj(const std::filesystem::path& file, bool& coloured) {
  const std::string text = text_of(file);
  std::string result;
  result.reserve(text.size());
  coloured = false;
  std::uint32_t number = 0;
  Lines lines(text);
  std::string_view line;
  while (lines.next(line)) {
    std::string_view rest = line;
    if (next_word(rest) != "v") {
      result.append(line) += '\n';
      continue;
    }
    const VertexLine vertex = vertex_line(rest);
    coloured |= vertex.words >= 6;
    fmt::format_to(std::back_inserter(result), "v {} {} {} 0\n", vertex.coordinates, number % kNumberBase,
                   number / kNumberBase);
    ++number;
  }
  return result;
}

}  // namespace esim::inline scene
