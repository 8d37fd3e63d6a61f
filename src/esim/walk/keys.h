#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace esim::inline walk {

/// Commands for walking through a scene.
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
  drop,     ///< add a waypoint here
  undo,     ///< remove the last waypoint
  preview,  ///< save an image of the view
  next,     ///< go to the next waypoint
  play,     ///< play the motion through the waypoints
  help,
  leave,
};

/// The help text of the keys.
std::string key_help();

/// Converts the bytes that a terminal sends to keys. Bytes of other keys are ignored.
class KeyReader {
 public:
  /// The complete keys; the possible beginning of another key waits for the next bytes.
  std::vector<Key> read(std::string_view bytes);

  /// Whether such a beginning is waiting.
  bool waits() const { return !waiting_.empty(); }

  /// Call it if no more bytes arrive: a waiting escape character is the key Esc.
  std::vector<Key> finish();

 private:
  std::string waiting_;
};

/// The keys of a text: characters as they are typed, including a space, and <left>, <right>, <up>, <down>, <space>,
/// <esc>. Throws UserError for other text.
std::vector<Key> keys_of(std::string_view text);

}  // namespace esim::inline walk
