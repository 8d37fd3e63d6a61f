#pragma once

#include <exception>
#include <filesystem>
#include <new>
#include <string>

#include "esim/core/error.h"
#include "esim/recording/record.h"

namespace esim::inline recording {

/// The result of `work()`, which fills and finishes `output`, a RecordingDirectory or a RecordingFile. If it fails
/// while `worth_keeping` is true, the data written so far are kept in output.path() (for archives, in the parts next to
/// it), and the error says so. OutputError and UserError keep their type; running out of memory becomes a UserError,
/// anything else an InternalError.
template <typename Output, typename Work>
auto keep_on_failure(Output& output, const bool& worth_keeping, const Work& work) {
  const auto kept = [&](const std::string& problem) {
    output.keep(problem);
    return problem + "; the output written so far is kept: " + output.path().string();
  };
  try {
    return work();
  } catch (const OutputError& error) {
    if (!worth_keeping) throw;
    throw OutputError(kept(error.what()));
  } catch (const UserError& error) {
    if (!worth_keeping) throw;
    throw UserError(kept(error.what()));
  } catch (const std::bad_alloc&) {
    if (!worth_keeping) throw;
    throw UserError(kept("out of memory: use smaller images, a smaller scene, or a machine with more memory"));
  } catch (const std::exception& error) {
    if (!worth_keeping) throw;
    throw InternalError(kept(error.what()));
  }
}

/// Ends a sink after a failure, as far as possible. Ignores further failures.
inline void end_incomplete(Sink& out) noexcept {
  try {
    out.end(false);
  } catch (...) {
  }
}

}  // namespace esim::inline recording
