#include "esim/files/input_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <utility>

#include "esim/core/error.h"
#include "esim/files/output_file.h"

namespace esim::inline files {
namespace {

constexpr std::size_t kBlockBytes = 1 << 18;

}  // namespace

InputFile::InputFile(std::filesystem::path path) : path_(std::move(path)) {
  const auto refuse = [&](std::string_view reason) {
    if (descriptor_ >= 0) ::close(descriptor_);
    throw UserError(fmt::format("cannot read {}: {}", path_.string(), reason));
  };
  descriptor_ = ::open(path_.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor_ < 0) refuse(system_reason(errno));
  struct stat status {};
  if (::fstat(descriptor_, &status) != 0) refuse(system_reason(errno));
  if (S_ISDIR(status.st_mode)) refuse("it is a folder");
  size_ = static_cast<std::uint64_t>(status.st_size);
}

InputFile::~InputFile() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

InputFile::InputFile(InputFile&& other) noexcept
    : path_(std::move(other.path_)),
      descriptor_(std::exchange(other.descriptor_, -1)),
      size_(other.size_),
      offset_(other.offset_),
      buffer_(std::move(other.buffer_)),
      begin_(other.begin_),
      end_(other.end_) {}

InputFile& InputFile::operator=(InputFile&& other) noexcept {
  std::swap(path_, other.path_);
  std::swap(descriptor_, other.descriptor_);
  std::swap(size_, other.size_);
  std::swap(offset_, other.offset_);
  std::swap(buffer_, other.buffer_);
  std::swap(begin_, other.begin_);
  std::swap(end_, other.end_);
  return *this;
}

/// Fills the buffer with at least `count` bytes, or all that are left.
void InputFile::fill(std::size_t count) {
  if (end_ - begin_ >= count) return;
  if (buffer_.size() < count) buffer_.resize(std::max(count, kBlockBytes));
  std::memmove(buffer_.data(), buffer_.data() + begin_, end_ - begin_);
  end_ -= std::exchange(begin_, 0);
  while (end_ < count) {
    const ssize_t got = ::read(descriptor_, buffer_.data() + end_, buffer_.size() - end_);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) fail(offset_ + (end_ - begin_), system_reason(errno));
    if (got == 0) return;
    end_ += static_cast<std::size_t>(got);
  }
}

std::span<const std::byte> InputFile::read(std::size_t max) {
  // Damaged files do not cause allocations larger than their size. If the size is unknown, as of pipes, the stated size
  // is used.
  if (size_ > 0) max = std::min<std::uint64_t>(max, std::max(size_, offset_) - offset_);
  fill(max);
  const std::size_t count = std::min(max, end_ - begin_);
  const std::span<const std::byte> bytes(buffer_.data() + begin_, count);
  begin_ += count, offset_ += count;
  return bytes;
}

std::size_t InputFile::read_into(std::span<std::byte> out) {
  const std::span<const std::byte> bytes = read(out.size());
  std::copy(bytes.begin(), bytes.end(), out.begin());
  return bytes.size();
}

std::span<const std::byte> InputFile::read_exactly(std::size_t count, std::string_view what) {
  const std::uint64_t start = offset_;
  const std::span<const std::byte> bytes = read(count);
  if (bytes.size() < count) fail(start + bytes.size(), fmt::format("the file ends within {}", what));
  return bytes;
}

std::string_view InputFile::read_line(std::size_t max, std::string_view what) {
  fill(max + 2);
  const auto* const start = reinterpret_cast<const char*>(buffer_.data()) + begin_;
  const std::string_view there(start, std::min(max + 2, end_ - begin_));
  const std::size_t end = there.find('\n');
  if (end == std::string_view::npos && there.size() > max) fail(offset_, fmt::format("{} is too long", what));
  std::string_view line = there.substr(0, end);
  const std::size_t used = std::min(line.size() + 1, there.size());
  begin_ += used, offset_ += used;
  if (line.ends_with('\r')) line.remove_suffix(1);
  return line;
}

void InputFile::seek(std::uint64_t offset) {
  if (offset > size_) fail(offset, "the file ends before this byte");
  if (::lseek(descriptor_, static_cast<off_t>(offset), SEEK_SET) < 0) fail(offset, system_reason(errno));
  offset_ = offset;
  begin_ = end_ = 0;
}

void InputFile::skip(std::uint64_t count) {
  const std::size_t there = end_ - begin_;
  if (count > there) return seek(offset_ + count);
  begin_ += static_cast<std::size_t>(count), offset_ += count;
}

void InputFile::fail(std::uint64_t offset, std::string_view reason) const {
  throw UserError(fmt::format("cannot read {}: at byte {}: {}", path_.string(), offset, reason));
}

std::string read_head(const std::filesystem::path& path, std::size_t max) {
  std::string head(max, '\0');
  std::ifstream file(path, std::ios::binary);
  file.read(head.data(), static_cast<std::streamsize>(max));
  head.resize(static_cast<std::size_t>(std::max<std::streamsize>(file.gcount(), 0)));
  return head;
}

std::string lower_extension(const std::filesystem::path& file) {
  std::string extension = file.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return extension;
}

}  // namespace esim::inline files
