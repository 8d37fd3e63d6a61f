#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <functional>
#include <string>
#include <string_view>

namespace esim::inline core {

/// An input file as it was when it was opened.
struct UsedFile {
  std::filesystem::path path;   ///< absolute
  bool regular = true;          ///< false for pipes and the like, which cannot be read twice
  std::uint64_t bytes = 0;      ///< its size
  std::int64_t changed_ns = 0;  ///< time of its latest change
  std::string sha256{};         ///< of its content, if that is known already

  bool operator==(const UsedFile&) const = default;
};

/// Receives the input files that readers open on this thread while it exists, each as often as it is opened. If there
/// are several listeners, the latest one receives them.
class UsedFilesListener {
 public:
  using Handler = std::function<void(const UsedFile&)>;
  explicit UsedFilesListener(Handler handler);
  ~UsedFilesListener();
  UsedFilesListener(const UsedFilesListener&) = delete;
  UsedFilesListener& operator=(const UsedFilesListener&) = delete;

 private:
  friend void note_used(const std::filesystem::path& file);

  Handler handler_;
  UsedFilesListener* outer_;
};

/// Tells the listener of this thread, if there is one, that `file` is about to be read. Every reader of a file that a
/// simulation can depend on calls this or open_input().
void note_used(const std::filesystem::path& file);

/// note_used(), then opens the file.
std::ifstream open_input(const std::filesystem::path& file);

/// A file in its current state; not regular if it cannot be examined.
UsedFile used_file(const std::filesystem::path& file);

/// A file whose content was read as `text`.
UsedFile used_text(const std::filesystem::path& file, std::string_view text);

}  // namespace esim::inline core
