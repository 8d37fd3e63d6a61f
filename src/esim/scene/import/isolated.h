#pragma once

#include <functional>
#include <string>

namespace esim {

/// How a piece of work in a process of its own ended.
struct IsolatedResult {
  enum class End { done, refused, crashed } end = End::crashed;
  std::string bytes;  ///< what it returned; of a refusal its message
};

/// Runs `work` in a copy of this process that may take `memory_bytes` more memory than it has, and `cpu_s` of a
/// processor's time: for libraries that cannot be trusted with damaged files. A UserError that it throws is a refusal;
/// whatever else goes wrong with the copy leaves this process unharmed, and is a crash. `work` must not wait for other
/// threads: the copy has none.
IsolatedResult run_isolated(const std::function<std::string()>& work, std::size_t memory_bytes, unsigned cpu_s);

}  // namespace esim
