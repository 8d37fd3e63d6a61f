#include <algorithm>
#include <array>
#include <optional>

#include "esim/files/number_text.h"
#include "esim/formats/hdf5/input.h"
#include "esim/formats/hdf5/truth.h"

namespace esim::inline formats {
namespace {

constexpr std::size_t kNumbersPerPose = 7;

SE3 pose_of(const hdf5::Input& file, const double* numbers) {
  const SE3 pose{Eigen::Quaterniond(numbers[6], numbers[3], numbers[4], numbers[5]), Eigen::Vector3d(numbers)};
  if (!(std::abs(pose.rotation.norm() - 1) < 1e-3) || !pose.translation.allFinite())
    file.fail("it holds an invalid pose");
  return pose;
}

}  // namespace

struct TruthHdf5Reader::Impl {
  explicit Impl(std::filesystem::path path) : file(std::move(path)) {}

  void open();

  /// An optional dataset of images of the common size, `planes` per frame.
  std::optional<hdf5::Column> open_images(const char* name, std::size_t planes);

  /// The same for a dataset that older recordings have under another name.
  std::optional<hdf5::Column> open_images(const char* name, const char* old_name, std::size_t planes) {
    return open_images(file.has(name) ? name : old_name, planes);
  }
  std::optional<hdf5::Column> open_poses(const char* name, std::size_t item_rank) const;

  template <typename T>
  void read(const hdf5::Column& images, std::uint64_t frame, Image<T>& out) const;
  void read(const hdf5::Column& images, std::uint64_t frame, Image<float>& x, Image<float>& y) const;

  hdf5::Input file;
  hdf5::Column t;
  std::optional<hdf5::Column> pose, depth, motion_field, objects, object_poses, optical_flow, optical_flow_valid;
  std::vector<std::string> names;
  std::uint64_t size = 0, optical_flows = 0;
  SensorSize sensor;
  mutable std::vector<float> vectors;
};

void TruthHdf5Reader::Impl::open() {
  t = file.open_column("t");
  pose = open_poses("T_world_camera", 1);
  depth = open_images("depth", 1);
  motion_field = open_images("motion_field", "flow", 2);
  objects = open_images("objects", 1);
  object_poses = open_poses("T_world_objects", 2);
  optical_flow = open_images("optical_flow", "displacement", 2);
  optical_flow_valid = open_images("optical_flow_valid", "displacement_valid", 1);
  if (objects) names = file.text_list_attribute(*objects, "names");

  // A killed writer may leave datasets of different lengths: their common part is valid.
  size = t.size;
  for (const auto* column : {&pose, &depth, &motion_field, &objects, &object_poses}) {
    if (*column) size = std::min<std::uint64_t>(size, (*column)->size);
  }
  const bool whole = file.integer_attribute("esim_complete").value_or(1) != 0;
  if (whole && size != t.size) file.fail("its datasets differ in length");
  if (optical_flow.has_value() != optical_flow_valid.has_value())
    file.fail("it must hold both optical_flow and optical_flow_valid, or neither");
  if (optical_flow && size > 0)
    optical_flows = std::min<std::uint64_t>({optical_flow->size, optical_flow_valid->size, size - 1});
}

std::optional<hdf5::Column> TruthHdf5Reader::Impl::open_images(const char* name, std::size_t planes) {
  if (!file.has(name)) return std::nullopt;
  hdf5::Column column = file.open_items(name, planes == 1 ? 2 : 3);
  const auto& shape = column.item_shape;
  if (planes != 1 && shape[0] != planes)
    file.fail(std::string(name) + " has " + std::to_string(shape[0]) + " components, not " + std::to_string(planes));
  const auto width = static_cast<int>(shape.back()), height = static_cast<int>(shape[shape.size() - 2]);
  if (sensor.width == 0) sensor = {width, height};
  if (width != sensor.width || height != sensor.height) file.fail("its images differ in size");
  return column;
}

std::optional<hdf5::Column> TruthHdf5Reader::Impl::open_poses(const char* name, std::size_t item_rank) const {
  if (!file.has(name)) return std::nullopt;
  hdf5::Column column = file.open_items(name, item_rank);
  if (column.item_shape.back() != kNumbersPerPose)
    file.fail(std::string(name) + " does not hold poses of seven numbers");
  return column;
}

template <typename T>
void TruthHdf5Reader::Impl::read(const hdf5::Column& images, std::uint64_t frame, Image<T>& out) const {
  if (out.empty()) out = Image<T>(sensor.width, sensor.height);
  file.read(images, frame, out.pixels());
}

void TruthHdf5Reader::Impl::read(const hdf5::Column& images, std::uint64_t frame, Image<float>& x,
                                 Image<float>& y) const {
  if (x.empty()) x = y = Image<float>(sensor.width, sensor.height);
  vectors.resize(2 * x.size());
  file.read(images, frame, std::span(vectors));
  std::copy_n(vectors.begin(), x.size(), x.data());
  std::copy_n(vectors.begin() + static_cast<std::ptrdiff_t>(x.size()), y.size(), y.data());
}

TruthHdf5Reader::TruthHdf5Reader(std::filesystem::path path) : impl_(std::make_unique<Impl>(std::move(path))) {
  impl_->open();
}

TruthHdf5Reader::~TruthHdf5Reader() {
  const hdf5::Quiet quiet;
  impl_.reset();
}

std::uint64_t TruthHdf5Reader::size() const { return impl_->size; }
std::uint64_t TruthHdf5Reader::optical_flows() const { return impl_->optical_flows; }
SensorSize TruthHdf5Reader::sensor() const { return impl_->sensor; }
const std::vector<std::string>& TruthHdf5Reader::names() const { return impl_->names; }

std::size_t TruthHdf5Reader::objects() const {
  return impl_->object_poses ? static_cast<std::size_t>(impl_->object_poses->item_shape[0]) : 0;
}

TimeNs TruthHdf5Reader::t(std::uint64_t frame) const {
  std::array<TimeNs, 2> times{};  // times of the previous frame and of this one
  const std::uint64_t first = frame > 0 ? frame - 1 : 0, count = frame - first + 1;
  impl_->file.read(impl_->t, first, std::span(times).first(count));
  const std::optional<TimeNs> before = count == 2 ? std::optional(times[0]) : std::nullopt;
  const auto problem = problem_of_time(before, times[count - 1]);
  if (!problem.empty()) impl_->file.fail("frame " + std::to_string(frame) + ": " + std::string(problem));
  return times[count - 1];
}

void TruthHdf5Reader::read(std::uint64_t frame, Frame& out) const {
  const Impl& impl = *impl_;
  if (impl.pose) {
    std::array<double, kNumbersPerPose> numbers{};
    impl.file.read(*impl.pose, frame, std::span<double>(numbers));
    out.T_world_camera = pose_of(impl.file, numbers.data());
  }
  if (impl.depth) impl.read(*impl.depth, frame, out.depth);
  if (impl.motion_field) impl.read(*impl.motion_field, frame, out.motion_x, out.motion_y);
  if (impl.objects) impl.read(*impl.objects, frame, out.object);
  if (!impl.object_poses) return;
  std::vector<double> numbers(impl.object_poses->item_numbers());
  impl.file.read(*impl.object_poses, frame, std::span(numbers));
  out.T_world_objects.clear();
  for (std::size_t i = 0; i < numbers.size(); i += kNumbersPerPose)
    out.T_world_objects.push_back(pose_of(impl.file, &numbers[i]));
}

void TruthHdf5Reader::read(std::uint64_t frame, OpticalFlow& out) const {
  impl_->read(*impl_->optical_flow, frame, out.x, out.y);
  impl_->read(*impl_->optical_flow_valid, frame, out.visible);
}

}  // namespace esim::inline formats
