#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

#include "esim/core/error.h"
#include "esim/files/input_file.h"
#include "esim/files/npy_header.h"
#include "esim/files/number_text.h"
#include "esim/files/output_file.h"
#include "esim/formats/images/image_sequences.h"
#include "esim/recording/record_stream.h"

namespace esim::inline formats {
namespace {

namespace fs = std::filesystem;
static_assert(std::endian::native == std::endian::little, "files are little-endian");

template <typename T>
constexpr std::string_view kType = "";
template <>
constexpr std::string_view kType<float> = "<f4";
template <>
constexpr std::string_view kType<double> = "<f8";
template <>
constexpr std::string_view kType<std::int64_t> = "<i8";
template <>
constexpr std::string_view kType<std::uint16_t> = "<u2";
template <>
constexpr std::string_view kType<std::uint8_t> = "|u1";

std::string quoted(std::string_view type) { return fmt::format("'{}'", type); }

/// An array that grows along its first dimension.
template <typename T>
class GrowingArray {
 public:
  GrowingArray(const fs::path& path, std::vector<std::uint64_t> item_shape)
      : file_(path), shape_(std::move(item_shape)) {
    shape_.insert(shape_.begin(), 0);
    file_.append(npy::header_text(quoted(kType<T>), shape_));
  }

  /// Appends one item, in parts. Afterwards the file is valid.
  void append(std::initializer_list<std::span<const T>> parts) {
    for (const std::span<const T> part : parts) {
      file_.append({reinterpret_cast<const char*>(part.data()), part.size_bytes()});
    }
    ++shape_[0];
    file_.flush();
    file_.overwrite_start(npy::header_text(quoted(kType<T>), shape_));
  }
  void close() { file_.close(); }

 private:
  OutputFile file_;
  std::vector<std::uint64_t> shape_;
};

/// Reads the items of an array one after the other.
template <typename T>
class NpyReader {
 public:
  NpyReader(const fs::path& path, std::size_t item_rank) : file_(path) {
    const npy::Header header = npy::read_header([&](std::span<std::byte> out) { return file_.read_into(out); },
                                                [&](const std::string& problem) { file_.fail(0, problem); });
    if (header.fortran_order) file_.fail(0, "the array must be in C order");
    if (header.descr.text != kType<T>)
      file_.fail(0, fmt::format("its type is {}, but must be {}", header.descr.text, kType<T>));
    if (header.shape.size() != item_rank + 1) file_.fail(0, fmt::format("it must have {} dimensions", item_rank + 1));
    items_ = header.shape[0];
    item_shape_.assign(header.shape.begin() + 1, header.shape.end());
    constexpr std::uint64_t kMaxImageExtent = 65536, kMaxNumbers = std::uint64_t{1} << 28;
    for (const std::uint64_t extent : item_shape_) {
      numbers_ *= extent;
      if (extent < 1 || extent > kMaxImageExtent || numbers_ > kMaxNumbers)
        file_.fail(0, "its shape is not valid for images");
    }
  }

  const std::vector<std::uint64_t>& item_shape() const { return item_shape_; }
  std::uint64_t left() const { return items_ - read_; }

  /// Fills the parts, which together are the next item.
  void read(std::initializer_list<std::span<T>> parts) {
    if (left() == 0) file_.fail(file_.size(), "it has fewer items than there are times");
    for (const std::span<T> part : parts) {
      // In pieces, so that a wrong shape does not allocate memory.
      constexpr std::size_t kPiece = 1 << 16;
      for (std::size_t done = 0; done < part.size(); done += kPiece) {
        const std::span<T> piece = part.subspan(done, std::min(kPiece, part.size() - done));
        std::memcpy(piece.data(), file_.read_exactly(piece.size_bytes(), "an item").data(), piece.size_bytes());
      }
    }
    ++read_;
  }

  /// Fails unless the file contains the bytes of the next item.
  void require_item() const {
    if ((file_.size() - file_.offset()) / sizeof(T) < numbers_)
      file_.fail(file_.size(), "the file ends within an item");
  }

  [[noreturn]] void fail(std::string_view reason) const { file_.fail(0, reason); }

 private:
  InputFile file_;
  std::uint64_t items_ = 0, read_ = 0, numbers_ = 1;
  std::vector<std::uint64_t> item_shape_;
};

constexpr std::size_t kPoseNumbers = 7;
constexpr const char *kSpans = "optical_flow_t.npy", *kOldSpans = "displacement_t.npy";

class NpyTruthWriter final : public Sink {
 public:
  explicit NpyTruthWriter(fs::path folder) : folder_(std::move(folder)) {}

  void begin(const RecordingInfo&) override { create_folder(folder_); }

  void write(const Record& record) override {
    if (const auto* truth = std::get_if<TruthRecord>(&record); truth != nullptr && truth->camera == 0) write(*truth);
    if (const auto* moved = std::get_if<OpticalFlowRecord>(&record); moved != nullptr && moved->camera == 0)
      write(*moved);
  }

  void end(bool) override {
    close(t_, pose_, irradiance_, depth_, motion_field_, objects_, optical_flow_t_, optical_flow_, optical_flow_valid_);
  }

 private:
  template <typename... Writers>
  static void close(Writers&... writers) {
    (..., (writers ? writers->close() : void()));
  }

  template <typename T>
  GrowingArray<T>& array(std::optional<GrowingArray<T>>& writer, const char* name,
                         std::vector<std::uint64_t> item_shape) {
    if (!writer) writer.emplace(folder_ / name, std::move(item_shape));
    return *writer;
  }

  template <typename T>
  static std::vector<std::uint64_t> shape_of(const Image<T>& image) {
    return {static_cast<std::uint64_t>(image.height()), static_cast<std::uint64_t>(image.width())};
  }
  static std::vector<std::uint64_t> shape_of_vectors(const Image<float>& image) {
    std::vector<std::uint64_t> shape = shape_of(image);
    shape.insert(shape.begin(), 2);
    return shape;
  }

  void write(const TruthRecord& truth) {
    const bool first = !t_;
    if (first) has_irradiance_ = !truth.irradiance.empty();
    array(t_, "t.npy", {}).append({std::span(&truth.t, 1)});
    const auto& [q, p] = truth.T_world_camera;
    const std::array<double, kPoseNumbers> pose = {p.x(), p.y(), p.z(), q.x(), q.y(), q.z(), q.w()};
    array(pose_, "T_world_camera.npy", {kPoseNumbers}).append({pose});
    if (has_irradiance_ && truth.irradiance.empty())
      throw OutputError("cannot write " + (folder_ / "irradiance.npy").string() + ": a frame has no irradiance");
    if (has_irradiance_)
      array(irradiance_, "irradiance.npy", shape_of(truth.irradiance)).append({truth.irradiance.pixels()});
    if (!truth.depth.empty()) array(depth_, "depth.npy", shape_of(truth.depth)).append({truth.depth.pixels()});
    if (!truth.motion_x.empty())
      array(motion_field_, "motion_field.npy", shape_of_vectors(truth.motion_x))
          .append({truth.motion_x.pixels(), truth.motion_y.pixels()});
    if (truth.object != nullptr)
      array(objects_, "objects.npy", shape_of(*truth.object)).append({truth.object->pixels()});
  }

  void write(const OpticalFlowRecord& moved) {
    const std::array<TimeNs, 2> span = {moved.t0, moved.t1};
    array(optical_flow_t_, kSpans, {2}).append({span});
    array(optical_flow_, "optical_flow.npy", shape_of_vectors(moved.x)).append({moved.x.pixels(), moved.y.pixels()});
    array(optical_flow_valid_, "optical_flow_valid.npy", shape_of(moved.visible)).append({moved.visible.pixels()});
  }

  fs::path folder_;
  bool has_irradiance_ = false;
  std::optional<GrowingArray<TimeNs>> t_, optical_flow_t_;
  std::optional<GrowingArray<double>> pose_;
  std::optional<GrowingArray<float>> irradiance_, depth_, motion_field_, optical_flow_;
  std::optional<GrowingArray<std::uint16_t>> objects_;
  std::optional<GrowingArray<std::uint8_t>> optical_flow_valid_;
};

/// The arrays in one folder; all images have one size.
class Folder {
 public:
  explicit Folder(fs::path path) : path_(std::move(path)) {}

  bool has(const char* name) const {
    std::error_code error;
    return fs::is_regular_file(path_ / name, error);
  }

  /// The name of a file that older recordings have under another name.
  const char* either(const char* name, const char* old_name) const { return has(name) ? name : old_name; }

  /// Nothing if the file does not exist. `vectors`: images of x and y.
  template <typename T>
  std::optional<NpyReader<T>> images(const char* name, bool vectors = false) {
    if (!has(name)) return std::nullopt;
    NpyReader<T> reader(path_ / name, vectors ? 3 : 2);
    const auto& shape = reader.item_shape();
    const SensorSize size{static_cast<int>(shape.back()), static_cast<int>(shape[shape.size() - 2])};
    if (vectors && shape[0] != 2) reader.fail("its vectors must have two components");
    if (size_.width == 0) size_ = size;
    if (size.width != size_.width || size.height != size_.height)
      reader.fail("its images differ in size from those of the other arrays");
    return reader;
  }

  template <typename T>
  NpyReader<T> numbers(const char* name, std::vector<std::uint64_t> item_shape) const {
    NpyReader<T> reader(path_ / name, item_shape.size());
    if (reader.item_shape() != item_shape) reader.fail("its shape is wrong");
    return reader;
  }

  template <typename T>
  void read(std::optional<NpyReader<T>>& reader, Image<T>& image) const {
    if (!reader) return;
    prepare(*reader, image);
    reader->read({image.pixels()});
  }
  void read(std::optional<NpyReader<float>>& reader, Image<float>& x, Image<float>& y) const {
    if (!reader) return;
    prepare(*reader, x);
    prepare(*reader, y);
    reader->read({x.pixels(), y.pixels()});
  }

  SensorSize size() const { return size_; }

 private:
  template <typename T>
  void prepare(const NpyReader<T>& reader, Image<T>& image) const {
    reader.require_item();
    if (image.empty()) image = Image<T>(size_.width, size_.height);
  }

  fs::path path_;
  SensorSize size_;
};

class FramesStream final : public RecordStream {
 public:
  explicit FramesStream(const std::shared_ptr<Folder>& folder)
      : folder_(folder),
        times_(folder->numbers<TimeNs>("t.npy", {})),
        irradiance_(folder->images<float>("irradiance.npy")),
        depth_(folder->images<float>("depth.npy")),
        motion_field_(folder->images<float>(folder->either("motion_field.npy", "flow.npy"), true)),
        objects_(folder->images<std::uint16_t>("objects.npy")) {
    if (folder->has("T_world_camera.npy")) poses_ = folder->numbers<double>("T_world_camera.npy", {kPoseNumbers});
  }

  std::optional<TimeNs> due() override {
    if (times_.left() == 0) return std::nullopt;
    const std::optional<TimeNs> last = t_;
    times_.read({std::span(&t_.emplace(), 1)});
    if (const auto problem = problem_of_time(last, *t_); !problem.empty()) times_.fail(problem);
    return t_;
  }

  const Record* next(TimeNs) override {
    SE3 pose;
    if (poses_) {
      std::array<double, kPoseNumbers> n{};
      poses_->read({n});
      pose = {Eigen::Quaterniond(n[6], n[3], n[4], n[5]), Eigen::Vector3d(n.data())};
      if (!(std::abs(pose.rotation.norm() - 1) < 1e-3) || !pose.translation.allFinite())
        poses_->fail("it holds an invalid pose");
    }
    folder_->read(irradiance_, images_.irradiance);
    folder_->read(depth_, images_.depth);
    folder_->read(motion_field_, images_.field_x, images_.field_y);
    folder_->read(objects_, object_);
    return &record_.emplace(TruthRecord{0, *t_, pose, images_.irradiance, images_.depth, images_.field_x,
                                        images_.field_y, object_.empty() ? nullptr : &object_});
  }

 private:
  std::shared_ptr<const Folder> folder_;
  NpyReader<TimeNs> times_;
  std::optional<NpyReader<double>> poses_;
  std::optional<NpyReader<float>> irradiance_, depth_, motion_field_;
  std::optional<NpyReader<std::uint16_t>> objects_;
  std::optional<TimeNs> t_;
  SequenceImages images_;
  Image<std::uint16_t> object_;
  std::optional<Record> record_;
};

class OpticalFlowStream final : public RecordStream {
 public:
  explicit OpticalFlowStream(const std::shared_ptr<Folder>& folder)
      : folder_(folder),
        times_(folder->numbers<TimeNs>(folder->either(kSpans, kOldSpans), {2})),
        optical_flow_(folder->images<float>(folder->either("optical_flow.npy", "displacement.npy"), true)),
        valid_(folder->images<std::uint8_t>(folder->either("optical_flow_valid.npy", "displacement_valid.npy"))) {
    if (!optical_flow_ || !valid_)
      times_.fail("optical_flow.npy or optical_flow_valid.npy is missing from the same folder");
  }

  std::optional<TimeNs> due() override {
    if (times_.left() == 0) return std::nullopt;
    const std::optional<TimeNs> last = times_read_ ? std::optional(span_[0]) : std::nullopt;
    times_.read({span_});
    times_read_ = true;
    for (const auto problem : {problem_of_time(last, span_[0]), problem_of_time(span_[0], span_[1])}) {
      if (!problem.empty()) times_.fail(problem);
    }
    return span_[1];
  }

  const Record* next(TimeNs) override {
    folder_->read(optical_flow_, x_, y_);
    folder_->read(valid_, visible_);
    return &record_.emplace(OpticalFlowRecord{0, span_[0], span_[1], x_, y_, visible_});
  }

 private:
  std::shared_ptr<const Folder> folder_;
  NpyReader<TimeNs> times_;
  std::optional<NpyReader<float>> optical_flow_;
  std::optional<NpyReader<std::uint8_t>> valid_;
  std::array<TimeNs, 2> span_{};
  bool times_read_ = false;
  Image<float> x_, y_;
  Image<std::uint8_t> visible_;
  std::optional<Record> record_;
};

/// Optical flow follows the frame at its end.
std::unique_ptr<Source> open_folder(const fs::path& path, const ReadOptions& options) {
  const auto folder = std::make_shared<Folder>(path);
  std::vector<std::unique_ptr<RecordStream>> streams;
  if (folder->has("t.npy")) streams.push_back(std::make_unique<FramesStream>(folder));
  if (folder->has(folder->either(kSpans, kOldSpans))) streams.push_back(std::make_unique<OpticalFlowStream>(folder));
  RecordingInfo info;
  CameraInfo& camera = info.cameras.emplace_back();
  camera.name = "cam0";
  camera.model.width = folder->size().width, camera.model.height = folder->size().height;
  return merge_streams(std::move(info), std::move(streams), options);
}

}  // namespace

Format npy_truth_format() {
  return {
      .name = "npy-truth",
      .description = "a folder of NumPy arrays: t, depth, motion_field, optical_flow, ... of all frames",
      .holds = {Content::truth, Content::optical_flow},
      .folder = true,
      .recognises =
          [](const auto& path, std::string_view) {
            const Folder folder(path);
            return folder.has("t.npy") || folder.has(folder.either(kSpans, kOldSpans));
          },
      .open = open_folder,
      .create = [](const auto& path, const WriteOptions&) { return std::make_unique<NpyTruthWriter>(path); },
  };
}

}  // namespace esim::inline formats
