#include "esim/formats/zip_archive.h"

#include <fmt/format.h>
#include <zip.h>

#include <utility>

#include "esim/core/error.h"
#include "esim/files/output_file.h"

namespace esim::inline formats {

namespace fs = std::filesystem;

ZipWriter::ZipWriter(fs::path path) : path_(std::move(path)), archive_(nullptr, zip_discard) {
  int code = 0;
  archive_.reset(zip_open(path_.c_str(), ZIP_CREATE | ZIP_TRUNCATE, &code));
  if (archive_) return;
  zip_error_t error;
  zip_error_init_with_code(&error, code);
  const std::string reason = zip_error_strerror(&error);
  zip_error_fini(&error);
  throw_cannot_write(path_, reason);
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
