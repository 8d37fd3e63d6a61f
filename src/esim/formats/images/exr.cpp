#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfInputFile.h>
#include <ImfOutputFile.h>
#include <ImfStdIO.h>
#include <fmt/format.h>

#include <array>
#include <exception>

#include "esim/core/error.h"
#include "esim/formats/images/image_sequences.h"
#include "esim/formats/images/timed_files.h"

namespace esim::inline formats {
namespace {

namespace fs = std::filesystem;

constexpr std::array kChannels = {"Y", "Z", "V.x", "V.y"};  // irradiance, depth, motion field

std::size_t row_bytes(const Image<float>& image) { return static_cast<std::size_t>(image.width()) * sizeof(float); }

/// Reads the channels that exist, as floats. Returns false if the file has none.
bool write_exr(const fs::path& path, const TruthRecord& truth) {
  const std::array images = {&truth.irradiance, &truth.depth, &truth.motion_x, &truth.motion_y};
  std::optional<Imf::Header> header;
  Imf::FrameBuffer buffer;
  for (std::size_t i = 0; i < kChannels.size(); ++i) {
    const Image<float>& image = *images[i];
    if (image.empty()) continue;
    if (!header) header.emplace(image.width(), image.height());
    header->channels().insert(kChannels[i], Imf::Channel(Imf::FLOAT));
    auto* const pixels = const_cast<char*>(reinterpret_cast<const char*>(image.data()));  // never written to
    buffer.insert(kChannels[i], Imf::Slice(Imf::FLOAT, pixels, sizeof(float), row_bytes(image)));
  }
  if (!header) return false;
  header->compression() = Imf::ZIP_COMPRESSION;
  Imf::StdOSStream memory;
  {
    Imf::OutputFile image(memory, *header);
    image.setFrameBuffer(buffer);
    image.writePixels(header->dataWindow().max.y + 1);
  }
  OutputFile file(path);
  file.append(memory.str());
  file.flush();
  return true;
}

void decode(const InputFile& file, std::span<const std::byte> bytes, SequenceImages& images) {
  Imf::StdISStream memory;
  memory.str({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
  Imf::InputFile image(memory);
  const auto window = image.header().dataWindow();
  const std::int64_t width = std::int64_t{window.max.x} - window.min.x + 1,
                     height = std::int64_t{window.max.y} - window.min.y + 1;
  constexpr std::int64_t kMaxExtent = 65536, kSmall = 1 << 20, kMaxPixelsPerByte = 2000;
  if (width < 1 || height < 1 || width > kMaxExtent || height > kMaxExtent ||
      (width * height > kSmall && width * height / kMaxPixelsPerByte > static_cast<std::int64_t>(bytes.size())))
    file.fail(0, fmt::format("the file is damaged: {} x {} px in {} bytes", width, height, bytes.size()));
  Imf::FrameBuffer buffer;
  const std::array planes = {&images.irradiance, &images.depth, &images.field_x, &images.field_y};
  for (std::size_t i = 0; i < kChannels.size(); ++i) {
    Image<float>& plane = *planes[i] = {};
    if (image.header().channels().findChannel(kChannels[i]) == nullptr) continue;
    plane = Image<float>(static_cast<int>(width), static_cast<int>(height));
    buffer.insert(kChannels[i], Imf::Slice::Make(Imf::FLOAT, plane.data(), window, sizeof(float), row_bytes(plane)));
  }
  if (buffer.begin() == buffer.end()) file.fail(0, "it has none of the channels Y, Z, V.x and V.y");
  if (images.field_x.empty() != images.field_y.empty()) file.fail(0, "it has only one of the channels V.x and V.y");
  image.setFrameBuffer(buffer);
  image.readPixels(window.min.y, window.max.y);
}

void read_exr(const fs::path& path, SequenceImages& images) {
  constexpr std::size_t kMaxBytes = std::size_t{1} << 30;
  InputFile file(path);
  try {
    decode(file, file.read(kMaxBytes), images);
  } catch (const UserError&) {
    throw;
  } catch (const std::exception& error) {
    file.fail(0, fmt::format("it cannot be decoded ({})", error.what()));
  }
}

class ExrWriter final : public Sink {
 public:
  explicit ExrWriter(fs::path folder) : folder_(std::move(folder)) {}

  void begin(const RecordingInfo&) override { files_.emplace(folder_, ".exr"); }
  void write(const Record& record) override {
    const auto* truth = std::get_if<TruthRecord>(&record);
    if (truth == nullptr || truth->camera != 0) return;
    if (write_exr(files_->next_path(), *truth)) files_->add(truth->t);
  }
  void end(bool) override { files_->close(); }

 private:
  fs::path folder_;
  std::optional<TimedFilesWriter> files_;
};

}  // namespace

Format exr_format() {
  return {
      .name = "exr",
      .description = "a folder of OpenEXR files: irradiance Y, depth Z, motion field V.x, V.y",
      .holds = {Content::truth},
      .folder = true,
      .recognises = [](const auto& path, std::string_view) { return lists_files(path, ".exr"); },
      .open =
          [](const auto& path, const ReadOptions& options) {
            FileSequence files = listed_files(path, false);
            files.read = read_exr;
            return open_sequences({files}, options);
          },
      .create = [](const auto& path, const WriteOptions&) { return std::make_unique<ExrWriter>(path); },
  };
}

}  // namespace esim::inline formats
