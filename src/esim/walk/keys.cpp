#include "esim/walk/keys.h"

#include <fmt/format.h>

#include <array>
#include <optional>
#include <utility>

#include "esim/core/error.h"

namespace esim::inline walk {
namespace {

constexpr char kEscape = '\033';
constexpr std::size_t kLongestSequence = 16;

std::optional<Key> key_of(char c) {
  if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  switch (c) {
    case 'w':
      return Key::forward;
    case 's':
      return Key::back;
    case 'a':
      return Key::left;
    case 'd':
      return Key::right;
    case 'q':
    case 'r':
      return Key::up;
    case 'e':
    case 'f':
      return Key::down;
    case '+':
    case '=':
      return Key::faster;
    case '-':
    case '_':
      return Key::slower;
    case ' ':
      return Key::drop;
    case 'u':
      return Key::undo;
    case 'p':
      return Key::preview;
    case 'g':
      return Key::next;
    case 't':
      return Key::play;
    case '?':
      return Key::help;
    case 'x':
      return Key::leave;
    default:
      return std::nullopt;
  }
}

std::optional<Key> arrow_of(char final) {
  switch (final) {
    case 'A':
      return Key::look_up;
    case 'B':
      return Key::look_down;
    case 'C':
      return Key::turn_right;
    case 'D':
      return Key::turn_left;
    default:
      return std::nullopt;
  }
}

constexpr std::array<std::pair<std::string_view, Key>, 6> kNames{{{"<left>", Key::turn_left},
                                                                  {"<right>", Key::turn_right},
                                                                  {"<up>", Key::look_up},
                                                                  {"<down>", Key::look_down},
                                                                  {"<space>", Key::drop},
                                                                  {"<esc>", Key::leave}}};

}  // namespace

std::string key_help() {
  return "w s  forward, back        arrows  turn, look up and down    space  drop a waypoint\n"
         "a d  left, right          + -     faster, slower            u      remove the last one\n"
         "q e  up, down (or r f)    p       image of the view         g      go to the next one\n"
         "?    this help            t       play the motion so far    x      end (or Esc)\n";
}

std::vector<Key> KeyReader::read(std::string_view bytes) {
  waiting_ += bytes;
  std::vector<Key> keys;
  std::string_view rest = waiting_;
  const auto take = [&](std::size_t count, std::optional<Key> key) {
    if (key) keys.push_back(*key);
    rest.remove_prefix(count);
  };
  while (!rest.empty()) {
    if (rest[0] != kEscape) {
      take(1, key_of(rest[0]));
    } else if (rest.size() == 1) {
      break;
    } else if (rest[1] == kEscape) {
      take(1, Key::leave);
    } else if (rest[1] != '[' && rest[1] != 'O') {
      take(2, key_of(rest[1]));  // with Alt
    } else {
      // A control sequence: parameters, and a final byte from @ to ~.
      std::size_t last = 2;
      while (last < rest.size() && (rest[last] < '@' || rest[last] > '~')) ++last;
      if (last == rest.size() && last < kLongestSequence) break;
      take(std::min(last + 1, rest.size()), last < rest.size() ? arrow_of(rest[last]) : std::nullopt);
    }
  }
  waiting_ = std::string(rest);
  return keys;
}

std::vector<Key> KeyReader::finish() {
  const bool escape = waiting_ == std::string(1, kEscape);
  waiting_.clear();
  return escape ? std::vector<Key>{Key::leave} : std::vector<Key>{};
}

std::vector<Key> keys_of(std::string_view text) {
  std::vector<Key> keys;
  for (std::size_t i = 0; i < text.size();) {
    std::optional<Key> key = key_of(text[i]);
    std::size_t length = 1;
    for (const auto& [name, named] : kNames) {
      if (text.substr(i).starts_with(name)) key = named, length = name.size();
    }
    if (!key) {
      throw UserError(
          fmt::format("keys: '{}' is not a key; the keys are w s a d q e r f + - u p g t ? x, the space, and <left> "
                      "<right> <up> <down> <space> <esc>",
                      text.substr(i, 1)));
    }
    keys.push_back(*key);
    i += length;
  }
  return keys;
}

}  // namespace esim::inline walk
