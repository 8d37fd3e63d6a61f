#include "esim/formats/zip_archive.h"

#include <fmt/format.h>
#include <zip.h>

#include <utility>

#include "esim/core/error.h"
#include "esim/files/output_file.h"

namespace esim::inline formats {
namespace {

namespace fs = std::filesystem;

/// Whether libzip says that the list of files at the end is missing; since 1.10, it has an error of its own for this.
bool is_truncated(int code) {
#ifdef ZIP_ER_TRUNCATED_ZIP
  if (code == ZIP_ER_TRUNCATED_ZIP) return true;
#endif
  return code == ZIP_ER_NOZIP;
}

/// Null if it fails, with the reason.
zip_t* open_archive(const fs::path& path, int flags, std::string& reason) {
  int code = 0;
  zip_t* const archive = zip_open(path.c_str(), flags, &code);
  if (archive != nullptr) return archive;
  if (is_truncated(code) && read_head(path, 2) == "PK") {
    reason = "the zip is truncated: the list of files at its end is missing";
    return nullptr;
  }
  zip_error_t error;
  zip_error_init_with_code(&error, code);
  reason = zip_error_strerror(&error);
  zip_error_fini(&error);
  return nullptr;
}

std::string reason_of(zip_error_t* error) {
  return zip_error_code_zip(error) == ZIP_ER_CRC ? "the file in the zip is damaged: its checksum is wrong"
                                                 : zip_error_strerror(error);
}

}  // namespace

ZipReader::ZipReader(fs::path path) : path_(std::move(path)) {
  std::string reason;
  archive_ = {open_archive(path_, ZIP_RDONLY, reason), [](zip_t* archive) {
                if (archive != nullptr) zip_discard(archive);
              }};
  if (!archive_) throw UserError(fmt::format("cannot read {}: {}", path_.string(), reason));
  const zip_int64_t count = zip_get_num_entries(archive_.get(), 0);
  for (zip_int64_t i = 0; i < count; ++i) {
    zip_stat_t status;
    const bool known = zip_stat_index(archive_.get(), static_cast<zip_uint64_t>(i), 0, &status) == 0;
    members_.push_back(known ? Member{status.name, status.size} : Member{});
  }
}

Read ZipReader::open(std::size_t member) const {
  const std::string name = path_.string() + ": " + members_.at(member).name;
  zip_file_t* const opened = zip_fopen_index(archive_.get(), member, 0);
  if (opened == nullptr)
    throw UserError(fmt::format("cannot read {}: {}", name, reason_of(zip_get_error(archive_.get()))));
  const std::shared_ptr<zip_file_t> file(opened, [archive = archive_](zip_file_t* ended) { zip_fclose(ended); });
  return [file, name](std::span<std::byte> out) {
    const zip_int64_t got = zip_fread(file.get(), out.data(), out.size());
    if (got < 0) throw UserError(fmt::format("cannot read {}: {}", name, reason_of(zip_file_get_error(file.get()))));
    return static_cast<std::size_t>(got);
  };
}

ZipWriter::ZipWriter(fs::path path) : path_(std::move(path)), archive_(nullptr, zip_discard) {
  std::string reason;
  archive_.reset(open_archive(path_, ZIP_CREATE | ZIP_TRUNCATE, reason));
  if (!archive_) throw_cannot_write(path_, reason);
}

void ZipWriter::add_file(const std::string& name, const fs::path& file, Packing packing) {
  add_source(name, zip_source_file(archive_.get(), file.c_str(), 0, -1), packing);
}

void ZipWriter::add(const std::string& name, std::string content, Packing packing) {
  const std::string& kept = contents_.emplace_back(std::move(content));
  add_source(name, zip_source_buffer(archive_.get(), kept.data(), kept.size(), 0), packing);
}

void ZipWriter::add_source(const std::string& name, void* from, Packing packing) {
  constexpr zip_uint16_t kFirstOfJanuary1980 = (1 << 5) | 1;  // makes the bytes independent of the date
  constexpr zip_uint32_t kReadable = 0100644U << 16;          // and of the permissions of the packed file
  auto* const source = static_cast<zip_source_t*>(from);
  if (source == nullptr) fail();
  const zip_int64_t added = zip_file_add(archive_.get(), name.c_str(), source, ZIP_FL_ENC_UTF_8);
  if (added < 0) {
    zip_source_free(source);
    fail();
  }
  const auto member = static_cast<zip_uint64_t>(added);
  const bool deflated = packing == Packing::deflated;  // fast: numbers compress well at any level
  if (zip_set_file_compression(archive_.get(), member, deflated ? ZIP_CM_DEFLATE : ZIP_CM_STORE, deflated ? 1 : 0) !=
          0 ||
      zip_file_set_dostime(archive_.get(), member, 0, kFirstOfJanuary1980, 0) != 0 ||
      zip_file_set_external_attributes(archive_.get(), member, 0, ZIP_OPSYS_UNIX, kReadable) != 0) {
    fail();
  }
}

void ZipWriter::close() {
  if (zip_close(archive_.get()) != 0) fail();
  static_cast<void>(archive_.release());
  sync_file(path_);
}

void ZipWriter::fail() const { throw_cannot_write(path_, zip_strerror(archive_.get())); }

}  // namespace esim::inline formats
