#include "esim/recording/fan_out.h"

#include <exception>
#include <vector>

namespace esim::inline recording {

void FanOut::begin(const RecordingInfo& info) {
  for (const auto& sink : sinks_) sink->begin(info);
}

void FanOut::write(const Record& record) {
  for (auto& sink : sinks_) {
    try {
      sink->write(record);
    } catch (...) {
      sink.reset();  // end() would fail: leave its output as it is
      end_rest();
      throw;
    }
  }
}

void FanOut::end_rest() noexcept {
  std::erase(sinks_, nullptr);
  try {
    end(false);
  } catch (...) {  // rethrow only the first failure
  }
  sinks_.clear();
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

}  // namespace esim::inline recording
