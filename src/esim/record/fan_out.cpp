#include "esim/record/fan_out.h"

#include <exception>

namespace esim {

void FanOut::begin(const RecordingInfo& info) {
  for (const auto& sink : sinks_) sink->begin(info);
}

void FanOut::write(const Record& record) {
  for (const auto& sink : sinks_) sink->write(record);
}

void FanOut::end(bool complete) {
  std::exception_ptr failure;
  for (const auto& sink : sinks_) {
    try {
      sink->end(complete);
    } catch (...) {
      if (!failure) failure = std::current_exception();
    }
  }
  if (failure) std::rethrow_exception(failure);
}

}  // namespace esim
