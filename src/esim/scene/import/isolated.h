#pragma once

#include <functional>
#include <string>

namespace esim::inline scene {

/// How work in a separate process ended.
struct IsolatedResult {
  enum class End { done, refused, crashed } end = End::crashed;
  std::string bytes;  ///< the result; for a refusal, its message
};

/// Runs `work` in a copy of this process, with limits of `memory_bytes` more memory and `cpu_s` of processor time. Use
/// it for libraries that are not safe with damaged files. If `work` throws a UserError, the result is a refusal; any
/// other failure of the copy is reported as a crash and does not affect this process. `work` must not wait for other
/// threads, since the copy has none.
IsolatedResult run_isolated(const std::function<std::string()>& work, std::size_t memory_bytes, unsigned cpu_s);

}  // namespace esim::inline scene
