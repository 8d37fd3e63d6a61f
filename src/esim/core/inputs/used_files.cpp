#include "esim/core/inputs/used_files.h"

#include <sys/stat.h>

#include <utility>

#include "esim/core/inputs/sha256.h"
#include "esim/core/time.h"

namespace esim::inline core {
namespace {

thread_local UsedFilesListener* listener_of_thread = nullptr;

std::filesystem::path absolute_path(const std::filesystem::path& file) {
  std::error_code error;
  const std::filesystem::path path = std::filesystem::absolute(file, error);
  return error ? file : path.lexically_normal();
}

}  // namespace

UsedFilesListener::UsedFilesListener(Handler handler)
    : handler_(std::move(handler)), outer_(std::exchange(listener_of_thread, this)) {}

UsedFilesListener::~UsedFilesListener() { listener_of_thread = outer_; }

void note_used(const std::filesystem::path& file) {
  if (listener_of_thread != nullptr) listener_of_thread->handler_(used_file(file));
}

std::ifstream open_input(const std::filesystem::path& file) {
  note_used(file);
  return std::ifstream(file, std::ios::binary);
}

UsedFile used_file(const std::filesystem::path& file) {
  UsedFile used{absolute_path(file), false};
  struct stat status {};
  if (::stat(file.c_str(), &status) != 0) return used;
  used.regular = S_ISREG(status.st_mode);
  if (!used.regular) return used;
  used.bytes = static_cast<std::uint64_t>(status.st_size);
  used.changed_ns = std::int64_t{status.st_mtim.tv_sec} * kNsPerSecond + status.st_mtim.tv_nsec;
  return used;
}

UsedFile used_text(const std::filesystem::path& file, std::string_view text) {
  return {absolute_path(file), true, text.size(), 0, sha256(text)};
}

}  // namespace esim::inline core
