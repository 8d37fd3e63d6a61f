#include <zlib.h>

#include <algorithm>
#include <array>
#include <exception>
#include <map>
#include <new>
#include <streambuf>
#include <utility>

#include "esim/core/error.h"
#include "esim/files/input_file.h"
#include "esim/formats/datasets/files_input.h"
#include "esim/formats/datasets/zip_layout.h"

namespace esim::inline formats {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kBlockBytes = 1 << 16;
constexpr std::uint64_t kMaxDirectoryBytes = std::uint64_t{1} << 28;
constexpr std::uint64_t kFarthestEnd = zip::kEndBytes + 65535;  // bytes; the end record with its longest comment

std::string_view text(std::span<const std::byte> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

struct Entry {
  std::uint16_t method = 0;
  std::uint32_t crc = 0;
  std::uint64_t packed_bytes = 0, bytes = 0, offset = 0;
};

/// One file in a zip, from its start. Data before damage are handed out first.
class EntryBuffer final : public std::streambuf {
 public:
  EntryBuffer(const fs::path& path, Entry entry) : file_(path), entry_(entry), left_(entry.packed_bytes) {
    file_.seek(entry.offset);
    const std::string_view header = text(file_.read_exactly(zip::kLocalHeaderBytes, "the header of a file in the zip"));
    if (zip::get<std::uint32_t>(header, 0) != zip::kLocalHeader) file_.fail(entry.offset, "the zip is damaged");
    const std::uint64_t skipped = zip::get<std::uint16_t>(header, 26) + zip::get<std::uint16_t>(header, 28);
    file_.seek(file_.offset() + skipped);
    if (entry.method != zip::kStored && entry.method != zip::kDeflated) {
      file_.fail(entry.offset, "a file in the zip uses a compression method other than deflate");
    }
    if (inflateInit2(&stream_, -MAX_WBITS) != Z_OK) throw std::bad_alloc();
  }
  ~EntryBuffer() override { inflateEnd(&stream_); }

 protected:
  int_type underflow() override {
    if (gptr() == egptr() && !refill()) return traits_type::eof();
    return traits_type::to_int_type(*gptr());
  }

  std::streamsize xsgetn(char* out, std::streamsize count) override {
    std::streamsize done = 0;
    while (done < count) {
      if (gptr() == egptr()) {
        try {
          if (damage_) std::rethrow_exception(damage_);
          if (!refill()) break;
        } catch (const UserError&) {
          damage_ = std::current_exception();
          if (done == 0) throw;
          break;
        }
      }
      const std::streamsize taken = std::min<std::streamsize>(count - done, egptr() - gptr());
      std::copy_n(gptr(), taken, out + done);
      gbump(static_cast<int>(taken));
      done += taken;
    }
    return done;
  }

 private:
  /// Reads the next bytes, at least one; returns false at the end.
  bool refill() {
    std::size_t count = 0;
    while (count == 0 && !ended_) count = entry_.method == zip::kStored ? next_stored() : next_inflated();
    crc_ = static_cast<std::uint32_t>(::crc32_z(crc_, reinterpret_cast<const Bytef*>(block_.data()), count));
    if (ended_ && crc_ != entry_.crc && count == 0)
      file_.fail(entry_.offset, "the file in the zip is damaged: its checksum is wrong");
    setg(block_.data(), block_.data(), block_.data() + count);
    return count > 0;
  }

  std::size_t next_stored() {
    const auto bytes = next_packed(block_.size());
    std::transform(bytes.begin(), bytes.end(), block_.begin(), [](std::byte byte) { return static_cast<char>(byte); });
    return bytes.size();
  }

  std::size_t next_inflated() {
    if (stream_.avail_in == 0) {
      const auto bytes = next_packed(kBlockBytes);
      // Data borrowed from the file stay valid until the next call.
      stream_.next_in = reinterpret_cast<Bytef*>(const_cast<std::byte*>(bytes.data()));
      stream_.avail_in = static_cast<uInt>(bytes.size());
    }
    stream_.next_out = reinterpret_cast<Bytef*>(block_.data());
    stream_.avail_out = static_cast<uInt>(block_.size());
    const int result = inflate(&stream_, Z_NO_FLUSH);
    const std::size_t count = block_.size() - stream_.avail_out;
    if (result == Z_STREAM_END) {
      ended_ = true;
    } else if (result != Z_OK && count == 0) {
      file_.fail(file_.offset(), "the file in the zip is damaged: it cannot be decompressed");
    }
    return count;
  }

  /// Empty at the end.
  std::span<const std::byte> next_packed(std::size_t max) {
    const auto bytes = file_.read(static_cast<std::size_t>(std::min<std::uint64_t>(max, left_)));
    if (bytes.empty() && left_ > 0) file_.fail(file_.offset(), "the zip ends within a file that it contains");
    left_ -= bytes.size();
    ended_ = left_ == 0 && entry_.method == zip::kStored;
    return bytes;
  }

  InputFile file_;
  Entry entry_;
  std::uint64_t left_;  // compressed bytes
  z_stream stream_{};
  bool ended_ = false;
  std::uint32_t crc_ = 0;
  std::array<char, kBlockBytes> block_;
  std::exception_ptr damage_;
};

class EntryStream final : public std::istream {
 public:
  EntryStream(const fs::path& path, const Entry& entry) : std::istream(nullptr), buffer_(path, entry) {
    rdbuf(&buffer_);
    exceptions(std::ios::badbit);  // let exceptions of the buffer pass
  }

 private:
  EntryBuffer buffer_;
};

class ZipInput final : public FilesInput {
 public:
  ZipInput(const fs::path& path, const std::string& beside) : file_(path) {
    read_directory();
    find_folder(beside);
  }

  bool has(const std::string& name) const override { return entries_.contains(folder_ + name); }
  std::uintmax_t size(const std::string& name) const override { return entries_.at(folder_ + name).bytes; }
  std::unique_ptr<std::istream> open(const std::string& name) const override {
    return std::make_unique<EntryStream>(file_.path(), entries_.at(folder_ + name));
  }
  fs::path path_of(const std::string& name) const override { return file_.path() / (folder_ + name); }

 private:
  struct Directory {
    std::uint64_t offset = 0, bytes = 0, entries = 0;
  };

  Directory find_directory();
  void read_directory();
  static void take_extra(std::string_view extra, Entry& entry);

  void find_folder(const std::string& beside) {
    for (const auto& [name, entry] : entries_) {
      if (!name.ends_with(beside)) continue;
      const std::string folder = name.substr(0, name.size() - beside.size());
      if (!folder.empty() && !folder.ends_with('/')) continue;
      folder_ = folder;
      return;
    }
  }

  InputFile file_;
  std::map<std::string, Entry> entries_;
  std::string folder_;  // with a slash at its end, or empty
};

ZipInput::Directory ZipInput::find_directory() {
  const std::uint64_t start = file_.size() - std::min(file_.size(), kFarthestEnd);
  file_.seek(start);
  const std::string end(text(file_.read(kFarthestEnd)));
  std::size_t at = end.size() < zip::kEndBytes ? std::string::npos : end.size() - zip::kEndBytes;
  while (at != std::string::npos && zip::get<std::uint32_t>(end, at) != zip::kEnd)
    at = at > 0 ? at - 1 : std::string::npos;
  if (at == std::string::npos)
    file_.fail(file_.size(), "the zip is truncated: the list of files at its end is missing");

  const Directory found{zip::get<std::uint32_t>(end, at + 16), zip::get<std::uint32_t>(end, at + 12),
                        zip::get<std::uint16_t>(end, at + 10)};
  if (found.offset != zip::kIn64 && found.bytes != zip::kIn64 && found.entries != zip::kManyEntries) return found;
  if (at < zip::kEnd64LocatorBytes ||
      zip::get<std::uint32_t>(end, at - zip::kEnd64LocatorBytes) != zip::kEnd64Locator) {
    return found;
  }
  file_.seek(zip::get<std::uint64_t>(end, at - zip::kEnd64LocatorBytes + 8));
  const std::uint64_t offset = file_.offset();
  const std::string_view end64 = text(file_.read_exactly(zip::kEnd64Bytes, "the end of the list of files"));
  if (zip::get<std::uint32_t>(end64, 0) != zip::kEnd64) file_.fail(offset, "the list of files in the zip is damaged");
  return {zip::get<std::uint64_t>(end64, 48), zip::get<std::uint64_t>(end64, 40), zip::get<std::uint64_t>(end64, 32)};
}

void ZipInput::read_directory() {
  const Directory directory = find_directory();
  if (directory.bytes > kMaxDirectoryBytes || directory.offset > file_.size()) {
    file_.fail(file_.size(), "the list of files in the zip is damaged");
  }
  file_.seek(directory.offset);
  for (std::uint64_t i = 0; i < directory.entries; ++i) {
    const std::uint64_t offset = file_.offset();
    const std::string head(text(file_.read_exactly(zip::kDirectoryEntryBytes, "the list of files")));
    if (zip::get<std::uint32_t>(head, 0) != zip::kDirectoryEntry) file_.fail(offset, "the list of files is damaged");
    Entry entry{zip::get<std::uint16_t>(head, 10), zip::get<std::uint32_t>(head, 16), zip::get<std::uint32_t>(head, 20),
                zip::get<std::uint32_t>(head, 24), zip::get<std::uint32_t>(head, 42)};
    const std::size_t name_bytes = zip::get<std::uint16_t>(head, 28), extra_bytes = zip::get<std::uint16_t>(head, 30),
                      comment_bytes = zip::get<std::uint16_t>(head, 32);
    const std::string rest(text(file_.read_exactly(name_bytes + extra_bytes + comment_bytes, "the list of files")));
    take_extra(std::string_view(rest).substr(name_bytes, extra_bytes), entry);
    if (file_.offset() - directory.offset > kMaxDirectoryBytes) file_.fail(offset, "the list of files is too long");
    if (entry.offset >= file_.size()) file_.fail(offset, "a file in the zip starts after the end of the zip");
    entries_.emplace(rest.substr(0, name_bytes), entry);
  }
}

/// Reads the extra field, which has the numbers that did not fit into 32 bits, in this order.
void ZipInput::take_extra(std::string_view extra, Entry& entry) {
  while (extra.size() >= 4) {
    const auto tag = zip::get<std::uint16_t>(extra, 0);
    std::string_view field = extra.substr(4, zip::get<std::uint16_t>(extra, 2));
    extra.remove_prefix(4 + field.size());
    if (tag != zip::kExtra64) continue;
    for (std::uint64_t* number : {&entry.bytes, &entry.packed_bytes, &entry.offset}) {
      if (*number != zip::kIn64 || field.size() < 8) continue;
      *number = zip::get<std::uint64_t>(field, 0);
      field.remove_prefix(8);
    }
  }
}

}  // namespace

std::unique_ptr<FilesInput> open_zip_input(const fs::path& path, const std::string& beside) {
  return std::make_unique<ZipInput>(path, beside);
}

}  // namespace esim::inline formats
