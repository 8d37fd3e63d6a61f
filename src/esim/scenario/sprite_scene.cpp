#include "esim/scenario/sprite_scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <sstream>

#include "esim/core/error.h"
#include "esim/core/inputs/used_files.h"

namespace esim::inline scenario {
namespace {

namespace fs = std::filesystem;

struct Range {
  double min, max;
};

/// The words of a scene file, in order.
class SceneWords {
 public:
  explicit SceneWords(const fs::path& file) : file_(file) {
    std::ifstream stream = open_input(file);
    std::string line;
    std::size_t bytes = 0;
    while (std::getline(stream, line)) {
      ++line_count_;
      bytes += line.size();
      if (bytes > kMaxBytes || line.find('\0') != std::string::npos) {
        throw UserError(fmt::format("scene {}: must be a .scene file, which is a few lines of text", file.string()));
      }
      std::istringstream words(line);
      for (std::string word; words >> word;) words_.push_back({word, line_count_});
    }
  }

  bool at_end() const { return next_ == words_.size(); }

  const std::string& word(const char* what) {
    if (at_end()) {
      throw UserError(fmt::format("scene {}:{}: ends where {} should follow; a sprite is an image and 12 numbers",
                                  file_.string(), line_count_, what));
    }
    return words_[next_++].text;
  }

  double number(const char* what, Range range) {
    const std::string text = word(what);
    double value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc{} || end != text.data() + text.size() || !(value >= range.min && value <= range.max)) {
      fail(fmt::format("{} is '{}', but must be a number from {} to {}", what, text, range.min, range.max));
    }
    return value;
  }

  int whole_number(const char* what, Range range) {
    const double value = number(what, range);
    if (value != std::floor(value)) fail(fmt::format("{} is {}, but must be a whole number", what, value));
    return static_cast<int>(value);
  }

  /// Throws UserError with the line of the latest word.
  [[noreturn]] void fail(const std::string& message) const {
    throw UserError(fmt::format("scene {}:{}: {}", file_.string(), words_[next_ - 1].line, message));
  }

 private:
  static constexpr std::size_t kMaxBytes = std::size_t{1} << 20;
  struct Word {
    std::string text;
    int line;
  };

  const fs::path& file_;
  std::vector<Word> words_;
  std::size_t next_ = 0;
  int line_count_ = 0;
};

/// The first existing file of the places where an image may be.
fs::path find_image(const fs::path& name, const fs::path& scene, const std::vector<fs::path>& search_path,
                    const SceneWords& words) {
  const fs::path beside = scene.parent_path();
  std::vector<fs::path> places = {beside / name, beside / name.filename()};
  for (const fs::path& folder : search_path) places.push_back(folder / name.filename());
  std::string tried;
  for (const fs::path& place : places) {
    std::error_code error;
    if (fs::is_regular_file(place, error)) return place;
    tried += (tried.empty() ? "" : ", ") + place.string();
  }
  words.fail(
      fmt::format("image {} is not found (tried {}); put it into the scene file's folder, or add its folder to "
                  "renderer.search_path",
                  name.filename().string(), tried));
}

SpriteOptions read_sprite(SceneWords& words, double duration_s, const fs::path& scene,
                          const std::vector<fs::path>& search_path) {
  constexpr Range kAngle{-1e9, 1e9}, kLength{-1e6, 1e6};
  SpriteOptions sprite;
  sprite.image = find_image(words.word("an image"), scene, search_path, words);
  sprite.units = SpriteUnits::sensor;
  sprite.median_px = words.whole_number("the median filter's side", {0, 255});
  sprite.gaussian_px = words.number("the blur", {0, 100});
  SpritePose start, end;
  end.t_s = duration_s;
  for (SpritePose* key : {&start, &end}) key->rotation_deg = words.number("a rotation", kAngle);
  for (const int axis : {0, 1}) {
    for (SpritePose* key : {&start, &end}) key->position[axis] = words.number("a position", kLength);
  }
  for (const int axis : {0, 1}) {
    for (SpritePose* key : {&start, &end}) key->scale[axis] = words.number("a scale", kLength);
  }
  sprite.poses = {start, end};
  return sprite;
}

}  // namespace

SpriteSceneFile read_sprite_scene(const fs::path& file, const std::vector<fs::path>& search_path) {
  std::error_code error;
  if (!fs::is_regular_file(file, error)) throw UserError(fmt::format("scene {}: no such file", file.string()));
  SceneWords words(file);
  SpriteSceneFile scene;
  scene.width = words.whole_number("the width", {1, 16384});
  scene.height = words.whole_number("the height", {1, 16384});
  const double duration_s = words.number("the duration", {1e-6, 1e8});
  while (!words.at_end()) scene.sprites.push_back(read_sprite(words, duration_s, file, search_path));
  if (scene.sprites.empty()) words.fail("sprites are missing; a sprite is an image and 12 numbers");
  scene.sprites.front().beyond = SpriteBeyond::mirror;
  std::reverse(scene.sprites.begin(), scene.sprites.end());
  return scene;
}

}  // namespace esim::inline scenario
