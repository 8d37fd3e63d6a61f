#pragma once

#include <string>
#include <string_view>

#include "esim/walk/half_blocks.h"

namespace esim::app {

/// The terminal of standard input and output in raw mode without echo, on its alternate screen. The destructor, and any
/// signal that can be caught, restore its state.
class Terminal {
 public:
  /// Whether standard input and output are a terminal.
  static bool is_there();

  /// Throws UserError if they are not. At most one Terminal may exist.
  Terminal();
  ~Terminal();
  Terminal(const Terminal&) = delete;
  Terminal& operator=(const Terminal&) = delete;

  struct Size {
    int columns = 80, rows = 24;
    bool operator==(const Size&) const = default;
  };
  Size size() const;

  /// According to COLORTERM.
  TerminalColours colours() const;

  /// The typed characters. Waits up to the given time; returns an empty text on a signal or a timeout.
  std::string read(int wait_ms);

  /// Whether the terminal is gone, so that no more input can come.
  bool closed() const { return closed_; }

  void write(std::string_view text);

 private:
  bool closed_ = false;
};

}  // namespace esim::app
