#include <webp/encode.h>

#include <cmath>
#include <string>
#include <string_view>

#include "esim/files/output_file.h"
#include "esim/preview/video_encoder.h"

// An animated WebP file: a list of chunks, each a name, its size and its bytes; one chunk per image.
namespace esim::inline preview {
namespace {

constexpr std::size_t kHeadBytes = 8;  // name and size

void append_number(std::string& bytes, std::size_t number, int count) {
  for (int i = 0; i < count; ++i) bytes += static_cast<char>(number >> (8 * i) & 0xff);
}

std::string head_of(std::string_view name, std::size_t bytes) {
  std::string head(name);
  append_number(head, bytes, 4);
  return head;
}

class WebPEncoder final : public VideoEncoder {
 public:
  WebPEncoder(const std::filesystem::path& path, VideoShape shape) : file_(path), shape_(shape) {
    if (std::max(shape.width, shape.height) > WEBP_MAX_DIMENSION)
      throw_cannot_write(path, "WebP images have at most 16383 px on each side");
    if (WebPConfigInit(&config_) == 0) throw_cannot_write(path, "another version of libwebp is installed");
    constexpr float kQuality = 80;
    constexpr int kFastest = 0;
    config_.quality = kQuality;
    config_.method = kFastest;
    file_.append(start_of_file(0));
    file_.flush();
  }

  void append(const Image<Rgb>& image) override {
    const std::string coded = encode(image);
    std::string frame;
    append_number(frame, 0, 6);  // position
    append_number(frame, static_cast<std::size_t>(shape_.width - 1), 3);
    append_number(frame, static_cast<std::size_t>(shape_.height - 1), 3);
    append_number(frame, static_cast<std::size_t>(end_of(frames_) - end_of(frames_ - 1)), 3);
    constexpr std::size_t kReplace = 2;  // the previous image, without blending
    append_number(frame, kReplace, 1);
    ++frames_;
    const std::string head = head_of("ANMF", frame.size() + coded.size());
    bytes_ += head.size() + frame.size() + coded.size();
    constexpr std::uint64_t kMaxBytes = 0xfffffff0U - 64;
    if (bytes_ > kMaxBytes) throw_cannot_write(file_.path(), "WebP files have at most 4 GiB; record less");
    file_.append(head);
    file_.append(frame);
    file_.append(coded);
    file_.flush_if_full();
  }

  void close() override {
    file_.flush();
    file_.overwrite_start(start_of_file(bytes_));
    file_.close();
  }

 private:
  /// When a frame ends, ms after the start of the video.
  std::int64_t end_of(std::int64_t frame) const {
    return std::llround(1e3 * static_cast<double>(frame + 1) / shape_.frames_per_s);
  }

  /// The size of the file, the size of the images, and endless repetition.
  std::string start_of_file(std::size_t bytes_of_frames) const {
    constexpr std::size_t kAnimated = 2, kExtended = 10, kAnimation = 6, kWebP = 4;
    const std::size_t rest = kWebP + kHeadBytes + kExtended + kHeadBytes + kAnimation + bytes_of_frames;
    std::string start = head_of("RIFF", rest) + "WEBP" + head_of("VP8X", kExtended);
    append_number(start, kAnimated, 4);
    append_number(start, static_cast<std::size_t>(shape_.width - 1), 3);
    append_number(start, static_cast<std::size_t>(shape_.height - 1), 3);
    start += head_of("ANIM", kAnimation);
    append_number(start, 0, static_cast<int>(kAnimation));  // black background, endless
    return start;
  }

  /// The chunk with a lossy image.
  std::string encode(const Image<Rgb>& image) const {
    WebPPicture picture;
    WebPMemoryWriter writer;
    WebPMemoryWriterInit(&writer);
    if (WebPPictureInit(&picture) == 0) throw_cannot_write(file_.path(), "another version of libwebp is installed");
    picture.width = image.width();
    picture.height = image.height();
    picture.writer = WebPMemoryWrite;
    picture.custom_ptr = &writer;
    const auto* const pixels = reinterpret_cast<const std::uint8_t*>(image.data());
    const bool done = WebPPictureImportRGB(&picture, pixels, static_cast<int>(sizeof(Rgb)) * image.width()) != 0 &&
                      WebPEncode(&config_, &picture) != 0;
    WebPPictureFree(&picture);
    constexpr std::size_t kStart = 12;  // of a file with one image
    std::string chunk;
    if (done && writer.size > kStart)
      chunk.assign(reinterpret_cast<const char*>(writer.mem) + kStart, writer.size - kStart);
    WebPMemoryWriterClear(&writer);
    if (chunk.empty()) throw_cannot_write(file_.path(), "libwebp cannot encode an image");
    return chunk;
  }

  OutputFile file_;
  VideoShape shape_;
  WebPConfig config_{};
  std::int64_t frames_ = 0;
  std::size_t bytes_ = 0;  // of all frames
};

}  // namespace

std::unique_ptr<VideoEncoder> make_webp_encoder(const std::filesystem::path& path, VideoShape shape) {
  return std::make_unique<WebPEncoder>(path, shape);
}

}  // namespace esim::inline preview
