#include <algorithm>
#include <optional>

#include "esim/files/output_file.h"
#include "esim/formats/events_reader.h"
#include "esim/formats/events_writer.h"
#include "esim/formats/prophesee/evt3_words.h"
#include "esim/formats/prophesee/prophesee.h"

// Files of EVT 3.0.

namespace esim::inline formats {
namespace {

// The clock wraps, but files may be longer, up to the maximum time of EVT 2.0.
constexpr std::int64_t kMaxEvt3Us = (std::int64_t{1} << 34) - 1;

class Evt3Writer final : public EventsWriter {
 public:
  void begin(const std::filesystem::path& path, SensorSize sensor) override {
    file_.emplace(path);
    file_->append(prophesee::raw_header("EVT3", "3.0", sensor));
  }

  void write(EventSpan events) override {
    while (!events.empty()) {
      const EventSpan portion = events.first(std::min(events.size(), kPortion));
      events = events.subspan(portion.size());
      encoder_.write(portion);
      put_words();
    }
  }

  void end() override {
    encoder_.end();
    put_words();
    file_->close();
    file_.reset();
  }

 private:
  static constexpr std::size_t kPortion = 1 << 12;

  void put_words() {
    const auto bytes = std::as_bytes(encoder_.words());
    file_->append({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
    encoder_.clear();
  }

  std::optional<OutputFile> file_;
  prophesee::evt3::Encoder encoder_;
};

class Evt3Reader final : public EventsReader {
 public:
  explicit Evt3Reader(const std::filesystem::path& path) : file_(path), header_(prophesee::read_header(file_)) {}

  SensorSize sensor() const override { return header_.sensor; }
  double progress() const override { return file_.progress(); }

  bool read(std::vector<Event>& events) override {
    while (events.size() < kPortion) {
      const std::uint64_t start = file_.offset();
      const auto words = prophesee::read_words(file_, words_, kBlockWords);
      if (words.empty()) return false;
      const bool sound = header_.endianness == "big" ? decode<true>(words) : decode<false>(words);
      portion_.move_to(events);
      if (!sound) file_.fail(start, "the times before this byte are out of range");
    }
    return true;
  }

 private:
  static constexpr std::size_t kBlockWords = 4096, kPortion = 1 << 15;

  template <bool kBigEndian>
  bool decode(std::span<const std::uint16_t> words) {
    return decoder_.decode<kBigEndian>(
        words, [&](TimeNs t, std::uint32_t x, std::uint32_t y, bool on) { portion_.put(t, x, y, on); },
        [](TimeNs, bool) {});
  }

  InputFile file_;
  prophesee::Header header_;
  std::unique_ptr<std::uint16_t[]> words_;
  prophesee::Portion portion_{12 * kBlockWords};
  prophesee::evt3::Decoder decoder_;
};

}  // namespace

Format evt3_format() {
  return {
      .name = "evt3",
      .description = "Prophesee RAW, EVT 3.0",
      .extensions = {".raw"},
      .holds = {Content::events},
      .resolution = kNsPerUs,
      .max_width = prophesee::evt3::kMaxExtent,
      .max_height = prophesee::evt3::kMaxExtent,
      .min_time = 0,
      .max_time = kMaxEvt3Us * kNsPerUs + kNsPerUs - 1,
      .recognises = [](const auto&, std::string_view head) { return prophesee::parse_header(head).encoding == "EVT3"; },
      .open =
          [](const auto& path, const ReadOptions& options) {
            return make_events_source(std::make_unique<Evt3Reader>(path), options);
          },
      .create = [](const auto& path,
                   const WriteOptions&) { return make_events_sink(std::make_unique<Evt3Writer>(), path, "evt3"); },
  };
}

}  // namespace esim::inline formats
