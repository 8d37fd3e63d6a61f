#include "esim/files/zip_reader.h"

#include <fmt/format.h>
#include <zip.h>

#include <utility>

#include "esim/core/error.h"

namespace esim::inline files {
namespace {

namespace fs = std::filesystem;

/// Whether libzip says that the list of files at the end is missing; since 1.10, it has an error of its own for this.
bool is_truncated(int code) {
#ifdef ZIP_ER_TRUNCATED_ZIP
  if (code == ZIP_ER_TRUNCATED_ZIP) return true;
#endif
  return code == ZIP_ER_NOZIP;
}

/// Why an archive cannot be opened.
std::string reason_of(int code, const fs::path& path) {
  if (is_truncated(code) && read_head(path, 2) == "PK")
    return "the zip is truncated: the list of files at its end is missing";
  zip_error_t error;
  zip_error_init_with_code(&error, code);
  std::string reason = zip_error_strerror(&error);
  zip_error_fini(&error);
  return reason;
}

std::string reason_of(zip_error_t* error) {
  return zip_error_code_zip(error) == ZIP_ER_CRC ? "the file in the zip is damaged: its checksum is wrong"
                                                 : zip_error_strerror(error);
}

}  // namespace

ZipReader::ZipReader(fs::path path) : path_(std::move(path)) {
  int code = 0;
  archive_ = {zip_open(path_.c_str(), ZIP_RDONLY, &code), [](zip_t* archive) {
                if (archive != nullptr) zip_discard(archive);
              }};
  if (!archive_) throw UserError(fmt::format("cannot read {}: {}", path_.string(), reason_of(code, path_)));
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

}  // namespace esim::inline files
