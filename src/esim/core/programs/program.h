#pragma once

#include <sys/types.h>

#include <string>
#include <vector>

namespace esim::inline core {

/// The path of a program: `name` itself if it has a slash, otherwise the first match on PATH; empty if not found.
std::string find_program(const std::string& name);

/// The file descriptors that become the streams of a program. Those without FD_CLOEXEC remain open in it, too.
struct ProgramStreams {
  int input = -1;  ///< -1: no input
  int output = 1;
  int errors = 2;
};

/// Starts a program, the first part of `command` being its path. It leads a process group, which Ctrl-C does not reach,
/// and ends with the thread that starts it. Throws UserError if no process can be created. A program that cannot be run
/// ends with the exit status 127.
pid_t start_program(const std::vector<std::string>& command, const ProgramStreams& streams);

/// Waits until a program ends. Its exit status, or 128 + the number of the signal that ended it.
int wait_for_program(pid_t program);

/// The same number from what waitpid() stores.
int exit_status_of(int status);

}  // namespace esim::inline core
