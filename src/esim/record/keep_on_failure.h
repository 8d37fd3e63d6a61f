#pragma once

#include <exception>
#include <filesystem>
#include <new>
#include <string>

#include "esim/core/error.h"
#include "esim/record/record.h"

namespace esim {

/// The result of `work()`, which fills `output`, a RecordingDirectory or a RecordingFile, and finishes it. If that
/// fails when `worth_keeping` is true, what has been written stays in output.path() (of archives, in the parts beside
/// it), and the error says so. OutputError and UserError stay what they are, too little memory becomes a UserError,
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

/// Ends a sink after a failure, as far as it can be. Failures of its own are known already.
inline void end_incomplete(Sink& out) noexcept {
  try {
    out.end(false);
  } catch (...) {
  }
}

}  // namespace esim
