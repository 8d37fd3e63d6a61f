#include "esim/formats/hdf5/v2e.h"

#include <limits>
#include <optional>
#include <string>

#include "esim/core/error.h"
#include "esim/core/remedy.h"
#include "esim/formats/hdf5/event_blocks.h"
#include "esim/formats/hdf5/event_columns.h"
#include "esim/formats/hdf5/input.h"

namespace esim::inline formats {
namespace {

constexpr char kEvents[] = "events";
constexpr std::size_t kV2eChunk = 1 << 14;  // events
constexpr std::int64_t kV2eLargestExtent = 65536;
constexpr std::int64_t kV2eLatestUs = std::numeric_limits<std::uint32_t>::max();

class V2eReader final : public EventBlocksReader {
 public:
  explicit V2eReader(const std::filesystem::path& path) : file_(path), events_(file_.open_items(kEvents, 1)) {
    if (events_.item_numbers() != 4) file_.fail("the rows of events must be t, x, y, p");
  }

 private:
  std::uint64_t event_count() const override { return events_.size; }

  void read_block(std::uint64_t first, std::uint64_t count, std::vector<Event>& events) override {
    numbers_.resize(4 * count);
    file_.read(events_, first, std::span(numbers_));
    for (std::size_t i = 0; i < count; ++i) {
      const std::int64_t* row = &numbers_[4 * i];
      if (row[0] < 0 || row[0] > kV2eLatestUs || row[1] < 0 || row[1] >= kV2eLargestExtent || row[2] < 0 ||
          row[2] >= kV2eLargestExtent) {
        file_.fail("event " + std::to_string(first + i) + " at " + std::to_string(row[0]) + " us and (" +
                   std::to_string(row[1]) + ", " + std::to_string(row[2]) + ") is out of range");
      }
      events.push_back({row[0] * kNsPerUs, static_cast<std::uint16_t>(row[1]), static_cast<std::uint16_t>(row[2]),
                        static_cast<std::int8_t>(row[3] == 1 ? 1 : -1)});
    }
  }

  hdf5::Input file_;
  hdf5::Column events_;
  std::vector<std::int64_t> numbers_;
};

class V2eWriter final : public Sink {
 public:
  V2eWriter(std::filesystem::path path, Compression compression) : path_(std::move(path)), compression_(compression) {}
  ~V2eWriter() override {
    const hdf5::Quiet quiet;
    series_ = hdf5::Series();
  }

  void begin(const RecordingInfo&) override {
    const hdf5::Quiet quiet;
    file_.emplace(path_);
    series_ = hdf5::Series(*file_, kEvents, {H5T_STD_U32LE, {4}, kV2eChunk, compression_});
    file_->flush();
  }

  void write(const Record& record) override {
    const auto* events = std::get_if<EventsRecord>(&record);
    if (events == nullptr || events->camera != 0) return;
    for (const Event& event : events->events) {
      if (event.t < 0 || event.t / kNsPerUs > kV2eLatestUs) {
        throw RemediableError(path_.string() + ": v2e holds times from 0 to 71 minutes, so an event at " +
                                  std::to_string(event.t / kNsPerSecond) + " s does not fit: choose another format",
                              Remedy::times_from_zero);
      }
      for (const std::int64_t number :
           {event.t / kNsPerUs, std::int64_t{event.x}, std::int64_t{event.y}, std::int64_t{event.polarity > 0}}) {
        rows_.push_back(static_cast<std::uint32_t>(number));
      }
      if (rows_.size() == 4 * kV2eChunk) write_chunk();
    }
  }

  void end(bool) override {
    if (!file_) return;
    const hdf5::Quiet quiet;
    write_chunk();
    series_ = hdf5::Series();
    file_->close();
    file_.reset();
  }

 private:
  void write_chunk() {
    const hdf5::Quiet quiet;
    series_.append(std::span<const std::uint32_t>(rows_));
    rows_.clear();
    file_->flush();
  }

  std::filesystem::path path_;
  Compression compression_;
  std::vector<std::uint32_t> rows_;  // not written yet
  std::optional<hdf5::Output> file_;
  hdf5::Series series_;  // declared last, closes before the file
};

bool is_v2e(const std::filesystem::path& path, std::string_view head) {
  if (!is_hdf5(head)) return false;
  try {
    return hdf5::Input(path).open_items(kEvents, 1).item_numbers() == 4;
  } catch (const UserError&) {
    return false;
  }
}

}  // namespace

Format v2e_format() {
  return {
      .name = "v2e",
      .description = "HDF5 in the layout of v2e",
      .holds = {Content::events},
      .resolution = kNsPerUs,
      .recognises = is_v2e,
      .open = [](const auto& path,
                 const ReadOptions& options) { return make_events_source(std::make_unique<V2eReader>(path), options); },
      .create =
          [](const auto& path, const WriteOptions& options) {
            const bool plain = options.compression == Compression::none;
            return std::make_unique<V2eWriter>(path, plain ? Compression::none : Compression::gzip);
          },
  };
}

}  // namespace esim::inline formats
