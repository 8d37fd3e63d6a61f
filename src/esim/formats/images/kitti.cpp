#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "esim/core/error.h"
#include "esim/formats/images/image_sequences.h"
#include "esim/formats/images/png_file.h"
#include "esim/formats/images/timed_files.h"
#include "esim/formats/text/csv.h"

namespace esim::inline formats {
namespace {

namespace fs = std::filesystem;

constexpr float kMaxNumber = 65535;
constexpr int kOffset = 32768;
constexpr float kKittiPerPixel = 64, kDsecPerPixel = 128;  // numbers per pixel of flow
constexpr float kPerMetre = 256;                           // numbers per metre of depth

/// Flow in red and green; blue is 1 where the flow is known, otherwise 0. Flow that is out of range counts as unknown.
void write_flow(const fs::path& path, const Image<float>& x, const Image<float>& y, float per_pixel) {
  PerColour<Image<std::uint16_t>> channels;
  channels.fill(Image<std::uint16_t>(x.width(), x.height()));
  for (std::size_t i = 0; i < x.size(); ++i) {
    const double red = std::round(double{x.data()[i]} * per_pixel) + kOffset,
                 green = std::round(double{y.data()[i]} * per_pixel) + kOffset;
    if (!(red >= 0 && red <= kMaxNumber && green >= 0 && green <= kMaxNumber)) continue;
    channels[0].data()[i] = static_cast<std::uint16_t>(red);
    channels[1].data()[i] = static_cast<std::uint16_t>(green);
    channels[2].data()[i] = 1;
  }
  write_png(path, channels);
}

PngImage read_numbers(const fs::path& path, std::size_t channels) {
  PngImage png = read_png(path);
  if (png.bits != 16 || png.channels.size() != channels) {
    throw UserError(fmt::format("cannot read {}: it has {} channels of {} bits, but must have {} of 16 bits",
                                path.string(), png.channels.size(), png.bits, channels));
  }
  return png;
}

void read_flow(const fs::path& path, SequenceImages& images, float per_pixel) {
  const PngImage png = read_numbers(path, 3);
  const Image<std::uint16_t>& known = png.channels[2];
  images.field_x = images.field_y =
      Image<float>(known.width(), known.height(), std::numeric_limits<float>::quiet_NaN());
  for (std::size_t i = 0; i < known.size(); ++i) {
    if (known.data()[i] == 0) continue;
    images.field_x.data()[i] = static_cast<float>(png.channels[0].data()[i] - kOffset) / per_pixel;
    images.field_y.data()[i] = static_cast<float>(png.channels[1].data()[i] - kOffset) / per_pixel;
  }
}

/// 0 means no depth: no surface, or out of range.
void write_depth(const fs::path& path, const Image<float>& depth) {
  Image<std::uint16_t> numbers(depth.width(), depth.height());
  std::transform(depth.pixels().begin(), depth.pixels().end(), numbers.pixels().begin(), [](float z) {
    const float number = std::round(z * kPerMetre);
    return z > 0 && number <= kMaxNumber ? static_cast<std::uint16_t>(std::max(number, 1.0F)) : std::uint16_t{0};
  });
  write_png(path, numbers);
}

void read_depth(const fs::path& path, SequenceImages& images) {
  const PngImage png = read_numbers(path, 1);
  const Image<std::uint16_t>& numbers = png.channels.front();
  images.depth = Image<float>(numbers.width(), numbers.height());
  std::transform(numbers.pixels().begin(), numbers.pixels().end(), images.depth.pixels().begin(), [](std::uint16_t n) {
    return n == 0 ? std::numeric_limits<float>::infinity() : static_cast<float>(n) / kPerMetre;
  });
}

class KittiWriter final : public Sink {
 public:
  explicit KittiWriter(fs::path folder) : folder_(std::move(folder)) {}

  void begin(const RecordingInfo&) override { create_folder(folder_); }

  void write(const Record& record) override {
    flow_.add(record);
    const auto* truth = std::get_if<TruthRecord>(&record);
    if (truth == nullptr || truth->camera != 0 || truth->depth.empty()) return;
    if (!depths_) depths_.emplace(folder_ / "depth", ".png");
    write_depth(depths_->next_path(), truth->depth);
    depths_->add(truth->t);
  }

  void end(bool) override {
    flow_.finish();
    if (depths_) depths_->close();
    if (flows_) flows_->close();
  }

 private:
  fs::path folder_;
  std::optional<TimedFilesWriter> depths_, flows_;
  FrameFlow flow_{[this](TimeSpan span, const Image<float>& x, const Image<float>& y) {
    if (!flows_) flows_.emplace(folder_ / "flow", ".png", true);
    write_flow(flows_->next_path(), x, y, kKittiPerPixel);
    flows_->add(span);
  }};
};

constexpr const char* kDsecList = "forward_timestamps.txt";

class DsecFlowWriter final : public Sink {
 public:
  explicit DsecFlowWriter(fs::path folder) : folder_(std::move(folder)) {}

  void begin(const RecordingInfo&) override {
    create_folder(folder_ / "forward");
    list_.emplace(folder_ / kDsecList);
    list_->append("# from_timestamp_us, to_timestamp_us\n");
  }
  void write(const Record& record) override { flow_.add(record); }
  void end(bool) override {
    flow_.finish();
    list_->close();
  }

 private:
  fs::path folder_;
  std::optional<OutputFile> list_;
  int count_ = 0;
  FrameFlow flow_{[this](TimeSpan span, const Image<float>& x, const Image<float>& y) {
    write_flow(folder_ / "forward" / fmt::format("{:06}.png", count_++), x, y, kDsecPerPixel);
    list_->append(fmt::format("{}, {}\n", span.start / kNsPerUs, span.end / kNsPerUs));
    list_->flush();
  }};
};

/// The files in order of their names, with one line of times for each.
FileSequence dsec_files(const fs::path& folder) {
  std::vector<fs::path> files;
  std::error_code error;
  for (fs::directory_iterator entry(folder / "forward", error), end; !error && entry != end; entry.increment(error)) {
    if (entry->path().extension() == ".png") files.push_back(entry->path());
  }
  std::sort(files.begin(), files.end());
  struct State {
    CsvReader list;
    std::vector<fs::path> files;
    std::size_t next = 0;
  };
  const auto state = std::make_shared<State>(State{CsvReader(folder / kDsecList, 2), std::move(files)});
  const auto next = [state](TimeSpan& span, fs::path& file) {
    auto& [list, names, index] = *state;
    if (!list.next()) return false;
    constexpr TimeNs kMax_us = std::numeric_limits<TimeNs>::max() / 2 / kNsPerUs;
    if (list.t() > kMax_us || list.integer(1) > kMax_us || list.integer(1) < list.t() || list.t() < 0)
      list.fail("the times are out of range or in the wrong order");
    span = {list.t() * kNsPerUs, list.integer(1) * kNsPerUs};
    if (index == names.size()) list.fail(fmt::format("there are only {} files in forward/", names.size()));
    file = names[index++];
    return true;
  };
  return {next, [](const fs::path& path, SequenceImages& images) { read_flow(path, images, kDsecPerPixel); }, true};
}

}  // namespace

Format kitti_format() {
  return {
      .name = "kitti",
      .description = "folders flow/ and depth/ of 16-bit PNG files, as in KITTI",
      .holds = {Content::truth, Content::optical_flow},
      .folder = true,
      .recognises =
          [](const auto& path, std::string_view) {
            return lists_files(path / "flow", ".png") || lists_files(path / "depth", ".png");
          },
      .open =
          [](const auto& path, const ReadOptions& options) {
            std::vector<FileSequence> sequences;
            if (lists_files(path / "depth", ".png")) {
              sequences.push_back(listed_files(path / "depth", false));
              sequences.back().read = read_depth;
            }
            if (lists_files(path / "flow", ".png")) {
              sequences.push_back(listed_files(path / "flow", true));
              sequences.back().read = [](const fs::path& file, SequenceImages& images) {
                read_flow(file, images, kKittiPerPixel);
              };
            }
            return open_sequences(std::move(sequences), options);
          },
      .create = [](const auto& path, const WriteOptions&) { return std::make_unique<KittiWriter>(path); },
  };
}

Format dsec_flow_format() {
  return {
      .name = "dsec-flow",
      .description = "DSEC's folder of optical flow: 16-bit PNG files in forward/, forward_timestamps.txt",
      .holds = {Content::truth, Content::optical_flow},
      .folder = true,
      .recognises =
          [](const auto& path, std::string_view) {
            std::error_code error;
            return fs::is_regular_file(path / kDsecList, error) && fs::is_directory(path / "forward", error);
          },
      .open = [](const auto& path, const ReadOptions& options) { return open_sequences({dsec_files(path)}, options); },
      .create = [](const auto& path, const WriteOptions&) { return std::make_unique<DsecFlowWriter>(path); },
  };
}

}  // namespace esim::inline formats
