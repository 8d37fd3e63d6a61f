#include <fmt/format.h>

#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

#include "esim/formats/images/image_sequences.h"
#include "esim/formats/images/timed_files.h"

namespace esim::inline formats {
namespace {

namespace fs = std::filesystem;
static_assert(std::endian::native == std::endian::little, "files are little-endian");

// As in the benchmark's own code: values above the threshold mean unknown flow, which is written as the second number.
constexpr float kUnknownAbove = 1e9F, kUnknown = 1e10F;

void write_flo(const fs::path& path, const Image<float>& x, const Image<float>& y) {
  OutputFile file(path);
  const std::array<std::int32_t, 2> size = {x.width(), x.height()};
  file.append("PIEH");
  file.append({reinterpret_cast<const char*>(size.data()), sizeof size});
  for (std::size_t i = 0; i < x.size(); ++i) {
    std::array<float, 2> flow = {x.data()[i], y.data()[i]};
    const bool known = std::abs(flow[0]) <= kUnknownAbove && std::abs(flow[1]) <= kUnknownAbove;
    if (!known) flow = {kUnknown, kUnknown};
    file.append({reinterpret_cast<const char*>(flow.data()), sizeof flow});
  }
  file.flush();
}

void read_flo(const fs::path& path, SequenceImages& images) {
  constexpr std::uint64_t kHeadBytes = 12;
  InputFile file(path);
  std::array<std::int32_t, 2> size{};
  const auto head = file.read_exactly(kHeadBytes, "the header");
  if (std::memcmp(head.data(), "PIEH", 4) != 0) file.fail(0, "it does not begin with PIEH, as .flo files do");
  std::memcpy(size.data(), &head[4], sizeof size);
  const auto [width, height] = size;
  constexpr int kMaxExtent = 65536;
  if (width < 1 || height < 1 || width > kMaxExtent || height > kMaxExtent)
    file.fail(4, fmt::format("the image size is invalid: {} x {} px", width, height));
  const std::uint64_t bytes =
      kHeadBytes + std::uint64_t{8} * static_cast<std::uint64_t>(width) * static_cast<std::uint64_t>(height);
  if (file.size() < bytes)
    file.fail(file.size(), fmt::format("the file is too short: {} x {} px need {} bytes", width, height, bytes));

  images.field_x = images.field_y = Image<float>(width, height);
  for (int row = 0; row < height; ++row) {
    const auto line = file.read_exactly(8 * static_cast<std::size_t>(width), "a row");
    for (int column = 0; column < width; ++column) {
      std::array<float, 2> flow{};
      std::memcpy(flow.data(), &line[8 * static_cast<std::size_t>(column)], sizeof flow);
      const bool known = std::abs(flow[0]) <= kUnknownAbove && std::abs(flow[1]) <= kUnknownAbove;
      if (!known) flow.fill(std::numeric_limits<float>::quiet_NaN());
      images.field_x(column, row) = flow[0];
      images.field_y(column, row) = flow[1];
    }
  }
}

class FloWriter final : public Sink {
 public:
  explicit FloWriter(fs::path folder) : folder_(std::move(folder)) {}

  void begin(const RecordingInfo&) override { files_.emplace(folder_, ".flo", true); }
  void write(const Record& record) override { flow_.add(record); }
  void end(bool) override {
    flow_.finish();
    files_->close();
  }

 private:
  fs::path folder_;
  std::optional<TimedFilesWriter> files_;
  FrameFlow flow_{[this](TimeSpan span, const Image<float>& x, const Image<float>& y) {
    write_flo(files_->next_path(), x, y);
    files_->add(span);
  }};
};

}  // namespace

Format flo_format() {
  return {
      .name = "flo",
      .description = "a folder of Middlebury .flo files: optical flow from frame to frame",
      .holds = {Content::truth, Content::optical_flow},
      .folder = true,
      .recognises = [](const auto& path, std::string_view) { return lists_files(path, ".flo"); },
      .open =
          [](const auto& path, const ReadOptions& options) {
            FileSequence files = listed_files(path, true);
            files.read = read_flo;
            return open_sequences({files}, options);
          },
      .create = [](const auto& path, const WriteOptions&) { return std::make_unique<FloWriter>(path); },
  };
}

}  // namespace esim::inline formats
