#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstring>

#include "esim/core/error.h"
#include "esim/files/npy_header.h"
#include "esim/files/output_file.h"
#include "esim/formats/datasets/shard.h"

namespace esim::inline formats {
namespace {

constexpr std::size_t kTarBlock = 512;

struct NumpyType {
  const char* descr;
  std::size_t bytes;
};

NumpyType numpy_type(NumberType type) {
  switch (type) {
    case NumberType::int8:
      return {"'|i1'", 1};
    case NumberType::uint8:
      return {"'|u1'", 1};
    case NumberType::uint16:
      return {"'<u2'", 2};
    case NumberType::uint32:
      return {"'<u4'", 4};
    case NumberType::int64:
      return {"'<i8'", 8};
    case NumberType::float32:
      return {"'<f4'", 4};
  }
  throw InternalError("this number type is not supported in NumPy files");
}

/// The header of a file in an archive: ustar, of POSIX.1-1988, without an owner, dated 1970. Written here, since calls
/// of libarchive would be as long.
std::string tar_header(const std::string& name, std::size_t bytes) {
  if (name.size() >= 100) throw InternalError(name + ": the name is too long for a tar file");
  std::string header(kTarBlock, '\0');
  const auto put = [&](std::size_t at, const std::string& text) { text.copy(header.data() + at, text.size()); };
  put(0, name);
  put(100, "0000644");
  put(108, "0000000");
  put(116, "0000000");
  put(124, fmt::format("{:011o}", bytes));
  put(136, "00000000000");
  put(148, "        ");  // the checksum counts its own field as blanks
  put(156, "0");
  put(257, "ustar");
  put(263, "00");
  unsigned sum = 0;
  for (const char c : header) sum += static_cast<unsigned char>(c);
  put(148, fmt::format("{:06o}", sum) + '\0');
  return header;
}

class TarShard final : public ShardWriter {
 public:
  explicit TarShard(const std::filesystem::path& path) : file_(path) {}

  void add(const ShardSequence& sequence) override {
    const std::string key = fmt::format("{:08}", sequence.index);
    for (const ShardArray& array : sequence.arrays) {
      std::string name = array.name;
      std::replace(name.begin(), name.end(), '/', '.');
      const NumpyType type = numpy_type(array.type);
      std::size_t bytes = type.bytes;
      for (const std::uint64_t extent : array.shape) bytes *= extent;
      add_file(fmt::format("{}.{}.npy", key, name), npy::header_text(type.descr, array.shape),
               {static_cast<const char*>(array.numbers), bytes});
    }
    add_file(key + ".json", {}, sequence.info);
  }

  void finish() override {
    file_.append(std::string(2 * kTarBlock, '\0'));
    file_.close();
  }

 private:
  void add_file(const std::string& name, std::string_view head, std::string_view content) {
    const std::size_t bytes = head.size() + content.size();
    file_.append(tar_header(name, bytes));
    file_.append(head);
    file_.append(content);
    file_.append(std::string((kTarBlock - bytes % kTarBlock) % kTarBlock, '\0'));
  }

  OutputFile file_;
};

}  // namespace

std::unique_ptr<ShardWriter> make_tar_shard(const std::filesystem::path& file) {
  return std::make_unique<TarShard>(file);
}

}  // namespace esim::inline formats
