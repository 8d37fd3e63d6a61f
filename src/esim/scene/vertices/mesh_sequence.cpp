#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <map>
#include <string_view>

#include "esim/files/input_file.h"
#include "esim/files/number_text.h"
#include "esim/scene/vertices/frame_readers.h"

namespace esim::inline scene {
namespace {

/// A file name with a run of #.
struct Pattern {
  std::string before, after;
  std::size_t digits = 0;
};

Pattern pattern_of(const std::filesystem::path& file) {
  const std::string name = file.filename().string();
  const std::size_t begin = name.find('#'), end = name.find_last_of('#') + 1;
  if (begin == std::string::npos || name.find_first_not_of('#', begin) != end)
    fail_vertices(file, "must have one run of # in its name for the numbers of the frames, as in cloth_####.obj");
  return {name.substr(0, begin), name.substr(end), end - begin};
}

/// The number in a name of the pattern: with at least so many digits, and no more leading zeros than these need.
std::optional<std::uint64_t> number_in(std::string_view name, const Pattern& pattern) {
  if (!name.starts_with(pattern.before) || !name.ends_with(pattern.after)) return std::nullopt;
  if (name.size() < pattern.before.size() + pattern.digits + pattern.after.size()) return std::nullopt;
  name.remove_prefix(pattern.before.size());
  name.remove_suffix(pattern.after.size());
  std::uint64_t number = 0;
  const bool all_digits = std::all_of(name.begin(), name.end(), [](char c) { return c >= '0' && c <= '9'; });
  if (!all_digits || (name.size() > pattern.digits && name.front() == '0')) return std::nullopt;
  const auto [end, error] = std::from_chars(name.data(), name.data() + name.size(), number);
  if (error != std::errc()) return std::nullopt;
  return number;
}

/// Throws UserError if numbers are missing between the first and the last one.
void check_complete(const std::filesystem::path& pattern, const std::map<std::uint64_t, std::filesystem::path>& files) {
  constexpr std::size_t kNamed = 100;  // of which a few are listed
  std::vector<std::string> missing;
  const std::uint64_t first = files.begin()->first, last = files.rbegin()->first;
  const std::uint64_t count = last - first - (files.size() - 1);
  for (std::uint64_t number = first; number < last && missing.size() < kNamed; ++number) {
    if (!files.contains(number)) missing.push_back(std::to_string(number));
  }
  if (count == 0) return;
  fail_vertices(pattern,
                fmt::format("{} of the frames {} to {} are missing: {}; export them, or remove the frames from "
                            "another export",
                            count, first, last, list_of_some(missing)));
}

}  // namespace

std::vector<std::filesystem::path> numbered_files(const std::filesystem::path& file) {
  const Pattern pattern = pattern_of(file);
  const std::filesystem::path folder = file.has_parent_path() ? file.parent_path() : std::filesystem::path(".");
  std::map<std::uint64_t, std::filesystem::path> files;
  std::error_code error;
  for (std::filesystem::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error)) {
    const std::filesystem::path& path = entry->path();
    const auto number = number_in(path.filename().string(), pattern);
    if (number && entry->is_regular_file(error)) files[*number] = folder / path.filename();
  }
  if (error) fail_vertices(file, fmt::format("its folder cannot be read: {}; check the path", error.message()));
  if (files.empty())
    fail_vertices(file,
                  fmt::format("no file has such a name, with a number of at least {} digits for {}; check the path, "
                              "and write a single # for numbers without zeros in front",
                              pattern.digits, std::string(pattern.digits, '#')));
  check_complete(file, files);
  std::vector<std::filesystem::path> result;
  for (const auto& [number, path] : files) result.push_back(path);
  return result;
}

VertexFrames read_mesh_sequence(const VertexFile& vertices, const std::filesystem::path& mesh_file,
                                const NumberedMesh& mesh) {
  const std::vector<std::filesystem::path> files = numbered_files(vertices.file);
  if (lower_extension(vertices.file) != lower_extension(mesh_file))
    fail_vertices(vertices.file,
                  fmt::format("must have the format of the mesh, {}; export one as the other", mesh_file.string()));
  check_counts(vertices.file, files.size(), mesh.vertices.size(), mesh.vertices.size());
  VertexFrames result{times_at_rate(vertices, files.size()), {}};
  result.positions.reserve(files.size() * mesh.vertices.size());
  for (const std::filesystem::path& file : files) {
    const NumberedMesh frame = read_numbered_mesh(file);
    if (frame.vertices.size() != mesh.vertices.size())
      fail_vertices(file,
                    fmt::format("has {} vertices, but {} has {}; all frames must have the same vertices and faces",
                                frame.vertices.size(), mesh_file.string(), mesh.vertices.size()));
    if (frame.faces != mesh.faces)
      fail_vertices(file, fmt::format("its faces are not those of {}, or are written differently; all frames must have "
                                      "the same vertices and faces",
                                      mesh_file.string()));
    result.positions.insert(result.positions.end(), frame.vertices.begin(), frame.vertices.end());
  }
  return result;
}

}  // namespace esim::inline scene
