#pragma once

#include <string>
#include <string_view>

#include "esim/walk/half_blocks.h"

namespace esim::app {

/// The terminal that standard input and output are, without echo and lines, on its alternate screen. It is as before
/// when this ends, and when the process is ended by a signal that can be caught.
class Terminal {
 public:
  /// Whether standard input and output are a terminal.
  static bool is_there();

  /// Throws UserError where they are not. One at a time.
  Terminal();
  ~Terminal();
  Terminal(const Terminal&) = delete;
  Terminal& operator=(const Terminal&) = delete;

  struct Size {
    int columns = 80, rows = 24;
    bool operator==(const Size&) const = default;
  };
  Size size() const;

  /// As COLORTERM says.
  TerminalColours colours() const;

  /// What has been typed; waits so long for it, and returns nothing where a signal comes or nothing is typed.
  std::string read(int wait_ms);

  /// Whether nothing more can be typed: the terminal has gone.
  bool closed() const { return closed_; }

  void write(std::string_view text);

 private:
  bool closed_ = false;
};

}  // namespace esim::app
