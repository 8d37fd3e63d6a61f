#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace esim {

/// What one may ask for while walking through a scene.
enum class Key {
  forward,
  back,
  left,
  right,
  up,
  down,
  turn_left,
  turn_right,
  look_up,
  look_down,
  faster,
  slower,
  drop,     ///< a way point here
  undo,     ///< the last way point
  preview,  ///< a picture of the view
  next,     ///< to the next way point
  play,     ///< the motion through the way points
  help,
  leave,
};

/// Lines that say which key does what.
std::string key_help();

/// Makes keys of the bytes that a terminal sends. Bytes that are no key of ours are passed over.
class KeyReader {
 public:
  /// The keys that are whole; what may be the beginning of another one waits for the next bytes.
  std::vector<Key> read(std::string_view bytes);

  /// Whether there is such a beginning.
  bool waits() const { return !waiting_.empty(); }

  /// No more bytes have come: an escape character that still waits was the key Esc.
  std::vector<Key> finish();

 private:
  std::string waiting_;
};

/// The keys of a text: characters as they are typed, a space among them, and <left>, <right>, <up>, <down>, <space>,
/// <esc>. Throws UserError for what is no key.
std::vector<Key> keys_of(std::string_view text);

}  // namespace esim
