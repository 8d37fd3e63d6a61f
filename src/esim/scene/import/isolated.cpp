#include "esim/scene/import/isolated.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstdint>
#include <cstring>
#include <fstream>

#include "esim/core/error.h"

namespace esim::inline scene {
namespace {

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kSanitized = true;  // sanitizers reserve terabytes of address space
#else
constexpr bool kSanitized = false;
#endif

void limit(int resource, std::size_t value) {
  const rlimit limits{value, value};
  ::setrlimit(resource, &limits);
}

/// Size of the address space that this process uses.
std::size_t address_bytes() {
  std::size_t pages = 0;
  std::ifstream("/proc/self/statm") >> pages;
  return pages * static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
}

bool write_all(int descriptor, const std::string& bytes) {
  for (std::size_t written = 0; written < bytes.size();) {
    const ssize_t count = ::write(descriptor, bytes.data() + written, bytes.size() - written);
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) return false;
    written += static_cast<std::size_t>(count);
  }
  return true;
}

/// The work of the copy; its exit status tells how it ended.
int work_in_copy(const std::function<std::string()>& work, int result) {
  try {
    return write_all(result, work()) ? 0 : 2;
  } catch (const UserError& error) {
    return write_all(result, error.what()) ? 1 : 2;
  } catch (...) {
    return 2;
  }
}

std::string content_of(int descriptor) {
  struct stat status {};
  ::fstat(descriptor, &status);
  std::string bytes(static_cast<std::size_t>(status.st_size), '\0');
  std::size_t read = 0;
  while (read < bytes.size()) {
    const ssize_t count = ::pread(descriptor, bytes.data() + read, bytes.size() - read, static_cast<off_t>(read));
    if (count <= 0) break;
    read += static_cast<std::size_t>(count);
  }
  bytes.resize(read);
  return bytes;
}

}  // namespace

IsolatedResult run_isolated(const std::function<std::string()>& work, std::size_t memory_bytes, unsigned cpu_s) {
  const int result = ::memfd_create("esim", MFD_CLOEXEC);
  if (result < 0) throw InternalError(std::string("cannot create a memory file: ") + std::strerror(errno));
  const std::size_t addresses = address_bytes() + memory_bytes;
  const pid_t copy = ::fork();
  if (copy < 0) {
    ::close(result);
    throw UserError(std::string("cannot start another process: ") + std::strerror(errno));
  }
  if (copy == 0) {
    if (const int nowhere = ::open("/dev/null", O_WRONLY); nowhere >= 0) {
      ::dup2(nowhere, STDOUT_FILENO);
      ::dup2(nowhere, STDERR_FILENO);
    }
    limit(RLIMIT_CORE, 0);
    limit(RLIMIT_CPU, cpu_s);
    if (!kSanitized) limit(RLIMIT_AS, addresses);
    ::_exit(work_in_copy(work, result));
  }

  int status = 0;
  while (::waitpid(copy, &status, 0) < 0 && errno == EINTR) {
  }
  IsolatedResult ended;
  if (WIFEXITED(status) && WEXITSTATUS(status) <= 1) {
    using End = IsolatedResult::End;
    ended = {WEXITSTATUS(status) == 0 ? End::done : End::refused, content_of(result)};
  }
  ::close(result);
  return ended;
}

}  // namespace esim::inline scene
