#include "esim/files/output_file.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>
#include <utility>

#include "esim/core/error.h"

namespace esim::inline files {
namespace {

constexpr std::size_t kBufferBytes = 1 << 18;

}  // namespace

std::string system_reason(int error_number) { return std::generic_category().message(error_number); }

void throw_cannot_write(const std::filesystem::path& path, std::string_view reason) {
  throw OutputError("cannot write " + path.string() + ": " + std::string(reason));
}

OutputFile::OutputFile(std::filesystem::path path) : path_(std::move(path)) {
  descriptor_ = ::open(path_.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
  if (descriptor_ < 0) throw_cannot_write(path_, system_reason(errno));
}

OutputFile::OutputFile(std::filesystem::path path, std::uint64_t kept) : path_(std::move(path)), flushed_(kept) {
  descriptor_ = ::open(path_.c_str(), O_WRONLY | O_CLOEXEC);
  if (descriptor_ < 0) throw_cannot_write(path_, system_reason(errno));
  const auto bytes = static_cast<off_t>(kept);
  const off_t size = ::lseek(descriptor_, 0, SEEK_END);
  const bool good =
      size >= bytes && ::ftruncate(descriptor_, bytes) == 0 && ::lseek(descriptor_, bytes, SEEK_SET) == bytes;
  if (good) return;
  const std::string reason = size >= 0 && size < bytes ? "it is shorter than it was" : system_reason(errno);
  ::close(std::exchange(descriptor_, -1));
  throw_cannot_write(path_, reason);
}

OutputFile::~OutputFile() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

void OutputFile::append(std::string_view text) {
  buffer_ += text;
  flush_if_full();
}

bool OutputFile::flush_if_full() {
  if (buffer_.size() < kBufferBytes) return false;
  flush();
  return true;
}

void OutputFile::overwrite_start(std::string_view text) {
  for (std::size_t done = 0; done < text.size();) {
    const ssize_t written = ::pwrite(descriptor_, text.data() + done, text.size() - done, static_cast<off_t>(done));
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) throw_cannot_write(path_, system_reason(errno));
    done += static_cast<std::size_t>(written);
  }
}

void OutputFile::flush() {
  std::string_view rest = buffer_;
  while (!rest.empty()) {
    const ssize_t written = ::write(descriptor_, rest.data(), rest.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) {
      const int error = errno;
      take_back(buffer_.size() - rest.size());
      throw_cannot_write(path_, system_reason(error));
    }
    rest.remove_prefix(static_cast<std::size_t>(written));
  }
  flushed_ += buffer_.size();
  buffer_.clear();
}

void OutputFile::take_back(std::size_t written) {
  const auto whole = static_cast<off_t>(flushed_);
  if (::ftruncate(descriptor_, whole) == 0 && ::lseek(descriptor_, whole, SEEK_SET) == whole) return;
  flushed_ += written;  // pipes cannot be rewound: avoid writing these bytes twice
  buffer_.erase(0, written);
}

void OutputFile::make_durable() {
  flush();
  // Pipes and devices cannot be synchronised: EINVAL is not a failure.
  if (::fsync(descriptor_) != 0 && errno != EINVAL) throw_cannot_write(path_, system_reason(errno));
}

void OutputFile::close() {
  if (descriptor_ < 0) return;
  make_durable();
  if (::close(std::exchange(descriptor_, -1)) != 0) throw_cannot_write(path_, system_reason(errno));
}

void write_file_atomically(const std::filesystem::path& path, std::string_view text) {
  std::filesystem::path temporary = path;
  temporary += kTemporaryExtension;
  std::error_code error, ignored;
  try {
    OutputFile file(temporary);
    file.append(text);
    file.close();
  } catch (const OutputError&) {
    std::filesystem::remove(temporary, ignored);
    throw;
  }
  std::filesystem::rename(temporary, path, error);
  if (!error) return;
  std::filesystem::remove(temporary, ignored);
  throw_cannot_write(path, error.message());
}

void create_folder(const std::filesystem::path& path) {
  std::error_code error;
  std::filesystem::create_directories(path, error);
  if (error) throw OutputError("cannot create the folder " + path.string() + ": " + error.message());
}

void sync_file(const std::filesystem::path& path) {
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) throw_cannot_write(path, system_reason(errno));
  const int error = ::fsync(descriptor) != 0 ? errno : 0;
  ::close(descriptor);
  if (error != 0) throw_cannot_write(path, system_reason(error));
}

void sync_directory(const std::filesystem::path& directory) {
  const int descriptor = ::open(directory.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0) return;
  ::fsync(descriptor);
  ::close(descriptor);
}

}  // namespace esim::inline files
