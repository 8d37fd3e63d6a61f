#pragma once

#include <string>

#include "esim/core/error.h"

namespace esim {

/// What a caller can ask for so that an error or a loss does not come again. How to ask for it depends on the
/// interface: the command line adds the flag to the message, the Python package the argument.
enum class Remedy {
  none,
  replace_output,   ///< let what is at the output's path be replaced
  choose_camera,    ///< choose one of several cameras
  extract_camera,   ///< copy one of several cameras into a file of its own first
  times_from_zero,  ///< let times count from the start of the recording
  nanoseconds,      ///< write times of events in nanoseconds
  shorter_video,    ///< show a part of the recording, or show it faster
};

/// A UserError with a remedy. The message names no flag and no argument.
class RemediableError : public UserError {
 public:
  RemediableError(const std::string& message, Remedy remedy) : UserError(message), remedy_(remedy) {}

  Remedy remedy() const { return remedy_; }

 private:
  Remedy remedy_;
};

}  // namespace esim
