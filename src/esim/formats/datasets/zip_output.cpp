#include <zlib.h>

#include <algorithm>
#include <map>
#include <new>
#include <optional>
#include <utility>

#include "esim/files/input_file.h"
#include "esim/files/output_file.h"
#include "esim/formats/datasets/files_output.h"
#include "esim/formats/datasets/zip_layout.h"

namespace esim::inline formats {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kBlockBytes = 1 << 18;

std::uint32_t extended_crc(std::uint32_t crc, std::string_view bytes) {
  return static_cast<std::uint32_t>(::crc32_z(crc, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

struct Entry {
  std::string name{};
  std::uint16_t method = zip::kStored;
  std::uint32_t crc = 0;
  std::uint64_t packed_bytes = 0, bytes = 0, offset = 0;
};

/// A text that is compressed into a separate file until it is copied into the archive. If the process ends before that,
/// the separate file holds the data recorded so far.
class PackedText {
 public:
  explicit PackedText(const fs::path& path) : file_(path) {
    // Raw deflate, without the zlib header, and fast: digits compress well at any level.
    if (deflateInit2(&stream_, 1, Z_DEFLATED, -MAX_WBITS, 8, Z_DEFAULT_STRATEGY) != Z_OK) throw std::bad_alloc();
  }
  ~PackedText() { deflateEnd(&stream_); }
  PackedText(const PackedText&) = delete;
  PackedText& operator=(const PackedText&) = delete;

  void append(std::string_view text) {
    plain_ += text;
    if (plain_.size() >= kBlockBytes) pack(Z_NO_FLUSH);
  }

  /// Completes the file.
  Entry finish(const std::string& name) {
    pack(Z_FINISH);
    file_.close();
    return {name, zip::kDeflated, crc_, stream_.total_out, stream_.total_in};
  }

  const fs::path& path() const { return file_.path(); }

 private:
  void pack(int flush) {
    crc_ = extended_crc(crc_, plain_);
    stream_.next_in = reinterpret_cast<Bytef*>(plain_.data());
    stream_.avail_in = static_cast<uInt>(plain_.size());
    std::string packed(kBlockBytes, '\0');
    do {
      stream_.next_out = reinterpret_cast<Bytef*>(packed.data());
      stream_.avail_out = static_cast<uInt>(packed.size());
      deflate(&stream_, flush);
      file_.append(std::string_view(packed).substr(0, packed.size() - stream_.avail_out));
    } while (stream_.avail_out == 0);
    plain_.clear();
  }

  OutputFile file_;
  z_stream stream_{};
  std::string plain_;
  std::uint32_t crc_ = 0;
};

class ZipOutput final : public FilesOutput {
 public:
  explicit ZipOutput(const fs::path& path) : file_(path) {}

  void add(const std::string& name, std::string_view content) override {
    add_header({name, zip::kStored, extended_crc(0, content), content.size(), content.size()});
    append_bytes(content);
  }

  void append(const std::string& name, std::string_view text) override {
    auto found = texts_.find(name);
    if (found == texts_.end()) {
      const std::string part = file_.path().string() + ".part" + std::to_string(texts_.size());
      found = texts_.try_emplace(name, part).first;
    }
    found->second.append(text);
  }

  void close() override {
    for (auto& [name, text] : texts_) {
      add_header(text.finish(name));
      copy(text.path());
    }
    write_directory();
    file_.close();
    for (const auto& [name, text] : texts_) {
      std::error_code ignored;
      fs::remove(text.path(), ignored);
    }
    texts_.clear();
  }

 private:
  void append_bytes(std::string_view bytes) {
    file_.append(bytes);
    position_ += bytes.size();
  }

  void copy(const fs::path& path) {
    InputFile part(path);
    for (auto block = part.read(kBlockBytes); !block.empty(); block = part.read(kBlockBytes)) {
      append_bytes({reinterpret_cast<const char*>(block.data()), block.size()});
    }
  }

  /// The fields that local headers and the directory have in common, from the version on.
  static void put_common(std::string& bytes, const Entry& entry, bool in_64) {
    constexpr std::uint16_t kFirstDay =
        0x0021;  // 1 January 1980, the earliest date of zip files: the bytes do not depend on the date
    zip::put<std::uint16_t>(bytes, in_64 ? 45 : 20);
    zip::put<std::uint16_t>(bytes, 0);
    zip::put(bytes, entry.method);
    zip::put<std::uint16_t>(bytes, 0);
    zip::put(bytes, kFirstDay);
    zip::put(bytes, entry.crc);
    zip::put(bytes, in_64 ? zip::kIn64 : static_cast<std::uint32_t>(entry.packed_bytes));
    zip::put(bytes, in_64 ? zip::kIn64 : static_cast<std::uint32_t>(entry.bytes));
    zip::put(bytes, static_cast<std::uint16_t>(entry.name.size()));
  }

  static void put_extra(std::string& bytes, const Entry& entry, bool with_offset) {
    zip::put(bytes, zip::kExtra64);
    zip::put<std::uint16_t>(bytes, with_offset ? 24 : 16);
    zip::put(bytes, entry.bytes);
    zip::put(bytes, entry.packed_bytes);
    if (with_offset) zip::put(bytes, entry.offset);
  }

  void add_header(Entry entry) {
    entry.offset = position_;
    const bool in_64 = std::max({entry.bytes, entry.packed_bytes, entry.offset}) >= zip::kIn64;
    std::string header;
    zip::put(header, zip::kLocalHeader);
    put_common(header, entry, in_64);
    zip::put<std::uint16_t>(header, in_64 ? 20 : 0);
    header += entry.name;
    if (in_64) put_extra(header, entry, false);
    append_bytes(header);

    zip::put(directory_, zip::kDirectoryEntry);
    zip::put<std::uint16_t>(directory_, in_64 ? 45 : 20);
    put_common(directory_, entry, in_64);
    zip::put<std::uint16_t>(directory_, in_64 ? 28 : 0);
    directory_.append(10, '\0');  // no comment, first disk, no attributes
    zip::put(directory_, in_64 ? zip::kIn64 : static_cast<std::uint32_t>(entry.offset));
    directory_ += entry.name;
    if (in_64) put_extra(directory_, entry, true);
    ++entries_;
  }

  void write_directory() {
    const std::uint64_t offset = position_, bytes = directory_.size();
    append_bytes(directory_);
    const bool in_64 = entries_ >= zip::kManyEntries || std::max(offset, bytes) >= zip::kIn64;
    std::string end;
    if (in_64) {
      zip::put(end, zip::kEnd64);
      zip::put<std::uint64_t>(end, zip::kEnd64Bytes - 12);
      zip::put<std::uint16_t>(end, 45), zip::put<std::uint16_t>(end, 45);
      zip::put<std::uint64_t>(end, 0);  // disks
      zip::put(end, entries_), zip::put(end, entries_);
      zip::put(end, bytes), zip::put(end, offset);
      zip::put(end, zip::kEnd64Locator);
      zip::put<std::uint32_t>(end, 0);
      zip::put(end, offset + bytes);
      zip::put<std::uint32_t>(end, 1);
    }
    const auto count = in_64 ? zip::kManyEntries : static_cast<std::uint16_t>(entries_);
    zip::put(end, zip::kEnd);
    zip::put<std::uint32_t>(end, 0);  // disks
    zip::put(end, count), zip::put(end, count);
    zip::put(end, in_64 ? zip::kIn64 : static_cast<std::uint32_t>(bytes));
    zip::put(end, in_64 ? zip::kIn64 : static_cast<std::uint32_t>(offset));
    zip::put<std::uint16_t>(end, 0);  // no comment
    append_bytes(end);
  }

  OutputFile file_;
  std::uint64_t position_ = 0;
  std::string directory_;  // about 70 bytes for each file
  std::uint64_t entries_ = 0;
  std::map<std::string, PackedText> texts_;
};

}  // namespace

std::unique_ptr<FilesOutput> make_zip_output(const fs::path& path) { return std::make_unique<ZipOutput>(path); }

}  // namespace esim::inline formats
