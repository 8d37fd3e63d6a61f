#include <map>
#include <utility>

#include "esim/files/output_file.h"
#include "esim/formats/datasets/files_input.h"
#include "esim/formats/datasets/files_output.h"

namespace esim::inline formats {
namespace {

namespace fs = std::filesystem;

class FolderOutput final : public FilesOutput {
 public:
  explicit FolderOutput(fs::path folder) : folder_(std::move(folder)) { make(folder_); }

  void add(const std::string& name, std::string_view content) override {
    const fs::path path = folder_ / name;
    make(path.parent_path());
    OutputFile file(path);
    file.append(content);
    file.flush();
  }

  void append(const std::string& name, std::string_view text) override {
    auto found = texts_.find(name);
    if (found == texts_.end()) {
      make((folder_ / name).parent_path());
      found = texts_.try_emplace(name, folder_ / name).first;
    }
    found->second.append(text);
  }

  void close() override {
    for (auto& [name, file] : texts_) file.close();
    texts_.clear();
    sync_directory(folder_);
  }

 private:
  static void make(const fs::path& folder) {
    std::error_code error;
    fs::create_directories(folder, error);
    if (error) throw_cannot_write(folder, error.message());
  }

  fs::path folder_;
  std::map<std::string, OutputFile> texts_;
};

class FolderInput final : public FilesInput {
 public:
  explicit FolderInput(fs::path folder) : folder_(std::move(folder)) {}

  bool has(const std::string& name) const override {
    std::error_code error;
    return fs::is_regular_file(folder_ / name, error);
  }

  std::uintmax_t size(const std::string& name) const override {
    std::error_code error;
    const std::uintmax_t size = fs::file_size(folder_ / name, error);
    return error ? 0 : size;
  }

  Read open(const std::string& name) const override {
    const auto file = std::make_shared<InputFile>(folder_ / name);
    return [file](std::span<std::byte> out) { return file->read_into(out); };
  }

  fs::path path_of(const std::string& name) const override { return folder_ / name; }

 private:
  fs::path folder_;
};

}  // namespace

std::unique_ptr<FilesOutput> make_folder_output(const fs::path& folder) {
  return std::make_unique<FolderOutput>(folder);
}

std::unique_ptr<FilesInput> open_folder_input(const fs::path& folder) { return std::make_unique<FolderInput>(folder); }

}  // namespace esim::inline formats
