#include "esim/core/inputs/file_hashes.h"

#include <utility>

#include "esim/core/inputs/sha256.h"

namespace esim::inline core {

FileHashes::FileHashes() : thread_([this] { work(); }) {}

FileHashes::~FileHashes() {
  if (thread_.joinable()) finish(false);
}

void FileHashes::add(const UsedFile& file) {
  const std::lock_guard lock(mutex_);
  if (!known_.emplace(file.path.string(), file.bytes, file.changed_ns).second) return;
  files_.push_back({file});
  changed_.notify_one();
}

std::vector<HashedFile> FileHashes::finish(bool wait) {
  {
    const std::lock_guard lock(mutex_);
    ended_ = true;
    stopped_ = !wait;
    changed_.notify_one();
  }
  thread_.join();
  return std::move(files_);
}

void FileHashes::work() {
  std::unique_lock lock(mutex_);
  while (true) {
    changed_.wait(lock, [&] { return done_ < files_.size() || ended_; });
    if (done_ == files_.size()) return;
    const UsedFile file = files_[done_].file;
    lock.unlock();
    HashedFile result = hashed(file);
    lock.lock();
    files_[done_++] = std::move(result);
  }
}

bool FileHashes::stops() {
  const std::lock_guard lock(mutex_);
  return stopped_;
}

HashedFile FileHashes::hashed(const UsedFile& file) {
  if (!file.sha256.empty()) return {file};
  if (!file.regular) return {file, "is not a regular file"};
  constexpr const char* kChanged = "was changed while it was used";
  if (used_file(file.path) != file) return {file, kChanged};
  std::ifstream stream(file.path, std::ios::binary);
  std::vector<std::byte> block(std::size_t{1} << 18);
  Sha256 sum;
  do {
    if (stops()) return {file, "was not read to its end again before the interruption"};
    stream.read(reinterpret_cast<char*>(block.data()), static_cast<std::streamsize>(block.size()));
    sum.add(std::span(block).first(static_cast<std::size_t>(stream.gcount())));
  } while (stream);
  if (!stream.eof()) return {file, "cannot be read a second time"};
  if (used_file(file.path) != file) return {file, kChanged};
  HashedFile result{file};
  result.file.sha256 = sum.finish();
  return result;
}

}  // namespace esim::inline core
