#include "esim/formats/hdf5/truth.h"

#include <optional>
#include <span>
#include <vector>

#include "esim/core/error.h"
#include "esim/formats/hdf5/library.h"

namespace esim::inline formats {

struct TruthHdf5Writer::Impl {
  Impl(std::filesystem::path file_path, int camera_index, TruthHdf5Options chosen)
      : path(std::move(file_path)), camera(camera_index), options(chosen) {}
  ~Impl() {
    const hdf5::Quiet quiet;
    close_series();
    file.reset();
  }

  void create(const RecordingInfo& recording);
  void create_optical_flow();
  void append(const TruthRecord& truth);
  void append(const OpticalFlowRecord& optical_flow);
  void append(hdf5::Series& series, const Image<float>& x, const Image<float>& y);
  void append(hdf5::Series& series, std::span<const SE3> poses);
  void append_object_poses(std::span<const SE3> poses);
  void describe(const hdf5::Series& series, const char* unit, const char* convention) const;
  void close_series() {
    esim_complete.reset();
    for (hdf5::Series* series :
         {&t, &pose, &depth, &motion_field, &objects, &object_poses, &optical_flow, &optical_flow_valid})
      *series = hdf5::Series();
  }
  template <typename T>
  void check_size(const Image<T>& image) const;

  std::filesystem::path path;
  int camera;
  TruthHdf5Options options;
  int width = 0, height = 0;
  std::vector<float> vector_frame;

  // Declared last, so that the series close before the file.
  std::optional<hdf5::Output> file;
  hdf5::Handle esim_complete;
  hdf5::Series t, pose, depth, motion_field, objects, object_poses, optical_flow, optical_flow_valid;
};

void TruthHdf5Writer::Impl::create(const RecordingInfo& recording) {
  const CameraInfo& info = recording.cameras.at(static_cast<std::size_t>(camera));
  width = info.model.width;
  height = info.model.height;
  const auto rows = static_cast<hsize_t>(height), columns = static_cast<hsize_t>(width);

  const hdf5::Quiet quiet;
  file.emplace(path);
  t = hdf5::Series(*file, "t", {H5T_STD_I64LE, {}, 256, Compression::none});
  describe(t, "ns", "time of the frame");
  pose = hdf5::Series(*file, "T_world_camera", {H5T_IEEE_F64LE, {7}, 64, Compression::none});
  describe(pose, "m",
           "tx ty tz qx qy qz qw: p_world = R(q) p_camera + t, Hamilton quaternion; camera x right, y down, "
           "z forward");
  if (options.depth) {
    depth = hdf5::Series(*file, "depth", {H5T_IEEE_F32LE, {rows, columns}, 1, options.compression});
    describe(depth, "m", "[frame, y, x]: z in the camera frame (planar depth); +inf where nothing is seen");
  }
  if (options.motion_field) {
    motion_field = hdf5::Series(*file, "motion_field", {H5T_IEEE_F32LE, {2, rows, columns}, 1, options.compression});
    describe(motion_field, "px/s",
             "[frame, component, y, x]: velocity of the image point, x to the right, then y downwards");
  }
  if (options.objects) {
    objects = hdf5::Series(*file, "objects", {H5T_STD_U16LE, {rows, columns}, 1, options.compression});
    describe(objects, "index of names", "[frame, y, x]: index of the object seen; 0: the static scene, or nothing");
    std::vector<std::string> names = {"static"};
    names.insert(names.end(), recording.objects.begin(), recording.objects.end());
    names.insert(names.end(), recording.sprites.begin(), recording.sprites.end());
    file->create_text_attribute(objects.id(), "names", names);
  }
  if (options.optical_flow) create_optical_flow();
  file->create_attribute(file->id(), "width", static_cast<std::uint32_t>(width));
  file->create_attribute(file->id(), "height", static_cast<std::uint32_t>(height));
  esim_complete = file->create_attribute(file->id(), "esim_complete", std::uint8_t{0});
  file->flush();
}

void TruthHdf5Writer::Impl::create_optical_flow() {
  const auto rows = static_cast<hsize_t>(height), columns = static_cast<hsize_t>(width);
  optical_flow = hdf5::Series(*file, "optical_flow", {H5T_IEEE_F32LE, {2, rows, columns}, 1, options.compression});
  describe(
      optical_flow, "px",
      "[frame k, component, y, x]: position in frame k + 1 of the point seen in frame k, minus its position in frame "
      "k; x to the right, then y downwards; NaN where the point has no image in frame k + 1");
  optical_flow_valid =
      hdf5::Series(*file, "optical_flow_valid", {H5T_STD_U8LE, {rows, columns}, 1, options.compression});
  describe(optical_flow_valid, "1",
           "[frame k, y, x]: 1 where frame k + 1 shows the point; 0 where it is occluded or outside the image");
}

void TruthHdf5Writer::Impl::describe(const hdf5::Series& series, const char* unit, const char* convention) const {
  file->create_text_attribute(series.id(), "unit", unit);
  file->create_text_attribute(series.id(), "convention", convention);
}

template <typename T>
void TruthHdf5Writer::Impl::check_size(const Image<T>& image) const {
  if (image.width() == width && image.height() == height) return;
  throw InternalError(path.string() + ": a ground-truth image has " + std::to_string(image.width()) + "x" +
                      std::to_string(image.height()) + " pixels, its camera " + std::to_string(width) + "x" +
                      std::to_string(height));
}

void TruthHdf5Writer::Impl::append(const TruthRecord& truth) {
  const hdf5::Quiet quiet;
  if (options.depth) {
    check_size(truth.depth);
    depth.append(truth.depth.pixels());
  }
  if (options.motion_field) append(motion_field, truth.motion_x, truth.motion_y);
  if (options.objects) {
    if (truth.object == nullptr)
      throw InternalError(path.string() + ": a ground-truth frame has no image of its objects");
    check_size(*truth.object);
    objects.append(truth.object->pixels());
    append_object_poses(truth.T_world_objects);
  }
  append(pose, {&truth.T_world_camera, 1});
  const std::int64_t time = truth.t;
  t.append(std::span<const std::int64_t>(&time, 1));
  file->flush();
}

void TruthHdf5Writer::Impl::append(const OpticalFlowRecord& record) {
  const hdf5::Quiet quiet;
  if (optical_flow.id() < 0) create_optical_flow();
  append(optical_flow, record.x, record.y);
  check_size(record.visible);
  optical_flow_valid.append(record.visible.pixels());
  file->flush();
}

void TruthHdf5Writer::Impl::append(hdf5::Series& series, const Image<float>& x, const Image<float>& y) {
  check_size(x);
  check_size(y);
  vector_frame.assign(x.pixels().begin(), x.pixels().end());
  vector_frame.insert(vector_frame.end(), y.pixels().begin(), y.pixels().end());
  series.append(std::span<const float>(vector_frame));
}

void TruthHdf5Writer::Impl::append(hdf5::Series& series, std::span<const SE3> poses) {
  std::vector<double> numbers;
  for (const auto& [q, p] : poses) numbers.insert(numbers.end(), {p.x(), p.y(), p.z(), q.x(), q.y(), q.z(), q.w()});
  series.append(std::span<const double>(numbers));
}

/// The first frame determines the number of objects.
void TruthHdf5Writer::Impl::append_object_poses(std::span<const SE3> poses) {
  if (poses.empty()) return;
  if (object_poses.id() < 0) {
    object_poses = hdf5::Series(*file, "T_world_objects", {H5T_IEEE_F64LE, {poses.size(), 7}, 64, Compression::none});
    describe(object_poses, "m",
             "[frame, object]: tx ty tz qx qy qz qw: p_world = R(q) p_object + t; in the order of the names of "
             "`objects`, without the first, static");
  }
  append(object_poses, poses);
}

TruthHdf5Writer::TruthHdf5Writer(std::filesystem::path path, int camera, TruthHdf5Options options)
    : impl_(std::make_unique<Impl>(std::move(path), camera, options)) {}

TruthHdf5Writer::~TruthHdf5Writer() = default;

void TruthHdf5Writer::begin(const RecordingInfo& info) { impl_->create(info); }

void TruthHdf5Writer::write(const Record& record) {
  const auto* truth = std::get_if<TruthRecord>(&record);
  if (truth != nullptr && truth->camera == impl_->camera) impl_->append(*truth);
  const auto* optical_flow = std::get_if<OpticalFlowRecord>(&record);
  if (optical_flow != nullptr && optical_flow->camera == impl_->camera) impl_->append(*optical_flow);
}

void TruthHdf5Writer::end(bool complete) {
  if (!impl_->file) return;
  const hdf5::Quiet quiet;
  if (complete) {
    constexpr std::uint8_t kOne = 1;
    impl_->file->check(H5Awrite(impl_->esim_complete, H5T_NATIVE_UINT8, &kOne));
  }
  impl_->close_series();
  impl_->file->close();
  impl_->file.reset();
}

}  // namespace esim::inline formats
