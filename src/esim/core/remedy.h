#pragma once

#include <string>

#include "esim/core/error.h"

namespace esim::inline core {

/// An option with which the caller can avoid an error or a loss. The interfaces name it differently: the command line
/// adds its flag to the message, the Python package its argument.
enum class Remedy {
  none,
  replace_output,   ///< replace what is at the output's path
  choose_camera,    ///< choose one of several cameras
  extract_camera,   ///< first copy one of several cameras into a separate file
  times_from_zero,  ///< count times from the start of the recording
  nanoseconds,      ///< write event times in nanoseconds
  sensor_size,      ///< state the size of the sensor
  shorter_video,    ///< show a part of the recording, or play it faster
  shift_times,      ///< shift the times of a recording
  keep_samples,     ///< simulate again, and keep what the event sensors saw
};

/// A UserError with a remedy. The message itself names neither a flag nor an argument.
class RemediableError : public UserError {
 public:
  RemediableError(const std::string& message, Remedy remedy) : UserError(message), remedy_(remedy) {}

  Remedy remedy() const { return remedy_; }

 private:
  Remedy remedy_;
};

}  // namespace esim::inline core
