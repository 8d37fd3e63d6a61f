#include <map>
#include <optional>
#include <set>

#include "esim/core/error.h"
#include "esim/formats/datasets/shard.h"
#include "esim/formats/hdf5/library.h"

namespace esim::inline formats {
namespace {

constexpr hsize_t kChunkNumbers = 1 << 16;

hid_t file_type(NumberType type) {
  switch (type) {
    case NumberType::int8:
      return H5T_STD_I8LE;
    case NumberType::uint8:
      return H5T_STD_U8LE;
    case NumberType::uint16:
      return H5T_STD_U16LE;
    case NumberType::uint32:
      return H5T_STD_U32LE;
    case NumberType::int64:
      return H5T_STD_I64LE;
    case NumberType::float32:
      return H5T_IEEE_F32LE;
  }
  throw InternalError("this number type is not supported in HDF5 files");
}

/// A growing series of numbers, written in whole chunks.
class Growing {
 public:
  Growing() = default;
  Growing(const hdf5::Output& file, const std::string& name, NumberType type)
      : type_(type), series_(file, name.c_str(), {file_type(type), {}, kChunkNumbers, Compression::blosc}) {}

  void append(const void* numbers, std::size_t count) {
    visit([&]<typename T>(T) {
      const auto* const bytes = static_cast<const std::byte*>(numbers);
      waiting_.insert(waiting_.end(), bytes, bytes + count * sizeof(T));
    });
    write(waiting_bytes() / (kChunkNumbers * size()) * kChunkNumbers);
  }
  void finish() { write(waiting_bytes() / size()); }
  hid_t id() const { return series_.id(); }

 private:
  template <typename Use>
  void visit(Use use) const {
    switch (type_) {
      case NumberType::int8:
        return use(std::int8_t{});
      case NumberType::uint8:
        return use(std::uint8_t{});
      case NumberType::uint16:
        return use(std::uint16_t{});
      case NumberType::uint32:
        return use(std::uint32_t{});
      case NumberType::int64:
        return use(std::int64_t{});
      case NumberType::float32:
        return use(float{});
    }
  }
  std::size_t size() const {
    std::size_t bytes = 0;
    visit([&]<typename T>(T) { bytes = sizeof(T); });
    return bytes;
  }
  std::size_t waiting_bytes() const { return waiting_.size(); }

  void write(std::size_t count) {
    if (count == 0) return;
    visit(
        [&]<typename T>(T) { series_.append(std::span<const T>(reinterpret_cast<const T*>(waiting_.data()), count)); });
    waiting_.erase(waiting_.begin(), waiting_.begin() + static_cast<std::ptrdiff_t>(count * size()));
  }

  NumberType type_ = NumberType::float32;
  hdf5::Series series_;
  std::vector<std::byte> waiting_;
};

class Hdf5Shard final : public ShardWriter {
 public:
  explicit Hdf5Shard(const std::filesystem::path& path) {
    const hdf5::Quiet quiet;
    file_.emplace(path);
    file_->create_text_attribute(file_->id(), "format", "esim sequences 1");
    index_ = hdf5::Series(*file_, "index", {H5T_STD_U32LE, {}, 1024, Compression::none});
    info_ = Growing(*file_, "info", NumberType::uint8);
  }

  void add(const ShardSequence& sequence) override {
    const hdf5::Quiet quiet;
    index_.append(std::span(&sequence.index, 1));
    const std::string line = sequence.info + "\n";
    info_.append(line.data(), line.size());
    for (const ShardArray& array : sequence.arrays) array.ragged ? add_ragged(array) : add_entry(array);
  }

  void finish() override {
    const hdf5::Quiet quiet;
    info_.finish();
    for (auto& [name, growing] : growing_) growing.finish();
    index_ = {}, info_ = {};
    growing_.clear(), entries_.clear(), starts_.clear();
    file_->close();
  }

 private:
  void create_parent(const std::string& name) {
    const std::string folder = name.substr(0, name.find('/'));
    if (folder != name && groups_.insert(folder).second) file_->create_group(folder.c_str());
  }

  void add_entry(const ShardArray& array) {
    auto found = entries_.find(array.name);
    if (found == entries_.end()) {
      create_parent(array.name);
      const std::vector<hsize_t> shape(array.shape.begin(), array.shape.end());
      found = entries_
                  .emplace(array.name, hdf5::Series(*file_, array.name.c_str(),
                                                    {file_type(array.type), shape, 1, Compression::blosc}))
                  .first;
      file_->create_text_attribute(found->second.id(), "about", array.about);
    }
    std::size_t count = 1;
    for (const std::uint64_t extent : array.shape) count *= extent;
    const auto append = [&]<typename T>(T) {
      found->second.append(std::span(static_cast<const T*>(array.numbers), count));
    };
    if (array.type == NumberType::float32) return append(float{});
    if (array.type == NumberType::uint8) return append(std::uint8_t{});
    throw InternalError(array.name + ": entries of shards must be float32 or uint8");
  }

  void add_ragged(const ShardArray& array) {
    auto found = growing_.find(array.name);
    const std::string start = array.name.substr(0, array.name.find('/')) + "/start";
    if (found == growing_.end()) {
      create_parent(array.name);
      found = growing_.emplace(array.name, Growing(*file_, array.name, array.type)).first;
      file_->create_text_attribute(found->second.id(), "about", array.about);
      if (!starts_.contains(start)) {
        starts_[start] =
            Start{array.name, 0, hdf5::Series(*file_, start.c_str(), {H5T_STD_U64LE, {}, 1024, Compression::none})};
        starts_[start].series.append(std::span<const std::uint64_t>(&starts_[start].end, 1));
      }
    }
    found->second.append(array.numbers, array.shape.front());
    Start& of_group = starts_[start];
    if (of_group.counted != array.name) return;
    of_group.end += array.shape.front();
    of_group.series.append(std::span<const std::uint64_t>(&of_group.end, 1));
  }

  /// The start indices of the sequences, for the arrays of a group, which have equal lengths.
  struct Start {
    std::string counted{};  // the array whose length is counted
    std::uint64_t end = 0;
    hdf5::Series series{};
  };

  // Declared last, so that the series close before the file.
  std::optional<hdf5::Output> file_;
  hdf5::Series index_;
  Growing info_;
  std::set<std::string> groups_;
  std::map<std::string, hdf5::Series> entries_;
  std::map<std::string, Growing> growing_;
  std::map<std::string, Start> starts_;
};

}  // namespace

std::unique_ptr<ShardWriter> make_hdf5_shard(const std::filesystem::path& file) {
  return std::make_unique<Hdf5Shard>(file);
}

}  // namespace esim::inline formats
