#include <map>
#include <utility>
#include <vector>

#include "esim/files/output_file.h"
#include "esim/files/zip_reader.h"
#include "esim/formats/datasets/files_input.h"
#include "esim/formats/datasets/files_output.h"
#include "esim/formats/zip_archive.h"

namespace esim::inline formats {
namespace {

namespace fs = std::filesystem;

class ZipOutput final : public FilesOutput {
 public:
  explicit ZipOutput(fs::path path) : path_(std::move(path)), parts_(path_.string() + ".part") {
    OutputFile(path_).close();  // fails now rather than at the end
    folder_ = make_folder_output(parts_);
  }

  void add(const std::string& name, std::string_view content) override {
    folder_->add(name, content);
    members_.emplace_back(name, ZipWriter::Packing::stored);
  }

  void append(const std::string& name, std::string_view text) override {
    folder_->append(name, text);
    texts_.try_emplace(name, ZipWriter::Packing::deflated);
  }

  void close() override {
    folder_->close();
    members_.insert(members_.end(), texts_.begin(), texts_.end());
    ZipWriter zip(path_);
    for (const auto& [name, packing] : members_) zip.add_file(name, parts_ / name, packing);
    zip.close();
    for (const auto& [name, packing] : members_) remove(name);
  }

 private:
  /// Removes a packed file, and its folders once they are empty.
  void remove(const fs::path& name) const {
    std::error_code not_empty;
    for (fs::path rest = name; !rest.empty() && !not_empty; rest = rest.parent_path())
      fs::remove(parts_ / rest, not_empty);
    if (!not_empty) fs::remove(parts_, not_empty);
  }

  fs::path path_, parts_;
  std::unique_ptr<FilesOutput> folder_;
  std::vector<std::pair<std::string, ZipWriter::Packing>> members_;
  std::map<std::string, ZipWriter::Packing> texts_;
};

class ZipInput final : public FilesInput {
 public:
  ZipInput(const fs::path& path, const std::string& beside) : zip_(path) {
    for (std::size_t i = 0; i < zip_.members().size(); ++i) members_.emplace(zip_.members()[i].name, i);
    find_folder(beside);
  }

  bool has(const std::string& name) const override { return members_.contains(folder_ + name); }
  std::uintmax_t size(const std::string& name) const override { return zip_.members()[member(name)].bytes; }
  Read open(const std::string& name) const override { return zip_.open(member(name)); }
  fs::path path_of(const std::string& name) const override { return zip_.path() / (folder_ + name); }

 private:
  std::size_t member(const std::string& name) const { return members_.at(folder_ + name); }

  void find_folder(const std::string& beside) {
    for (const auto& [name, member] : members_) {
      if (!name.ends_with(beside)) continue;
      const std::string folder = name.substr(0, name.size() - beside.size());
      if (!folder.empty() && !folder.ends_with('/')) continue;
      folder_ = folder;
      return;
    }
  }

  ZipReader zip_;
  std::map<std::string, std::size_t> members_;
  std::string folder_;  // with a slash at its end, or empty
};

}  // namespace

std::unique_ptr<FilesOutput> make_zip_output(const fs::path& path) { return std::make_unique<ZipOutput>(path); }

std::unique_ptr<FilesInput> open_zip_input(const fs::path& path, const std::string& beside) {
  return std::make_unique<ZipInput>(path, beside);
}

}  // namespace esim::inline formats
