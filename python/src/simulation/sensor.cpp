#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <optional>

#include "arrays.h"
#include "bindings.h"
#include "esim/core/error.h"
#include "esim/core/parallel.h"
#include "esim/event_camera/event_camera.h"
#include "esim/reproject/frames/reprojected_frames.h"
#include "esim/scenario/conversion.h"

namespace esim::python {
namespace {

template <typename T>
using Plane = nb::ndarray<const T, nb::ndim<2>, nb::c_contig, nb::device::cpu>;
using TwoPlanes = nb::ndarray<const float, nb::shape<2, -1, -1>, nb::c_contig, nb::device::cpu>;
using Matrices = nb::ndarray<const double, nb::shape<-1, 4, 4>, nb::c_contig, nb::device::cpu>;

template <typename T>
Image<T> image_of(const T* from, std::size_t height, std::size_t width) {
  Image<T> image(static_cast<int>(width), static_cast<int>(height));
  std::copy_n(from, height * width, image.data());
  return image;
}

std::vector<SE3> poses_in(const Matrices& matrices, const char* name) {
  std::vector<SE3> poses;
  for (std::size_t i = 0; i < matrices.shape(0); ++i) {
    try {
      poses.push_back(pose_in(matrices.data() + 16 * i));
    } catch (const UserError& error) {
      throw UserError(std::string(name) + ": " + error.what());
    }
  }
  return poses;
}

/// An event camera that sees the frames of another simulator, moved along the motion between them. _sensor.py checks
/// arguments.
class Sensor {
 public:
  Sensor(const std::vector<std::string>& lens, int supersampling, int margin_px, double lambda,
         const std::vector<std::string>& options, std::uint64_t seed, int threads)
      : workers_(threads),
        options_(read_event_camera(options, "")),
        layout_(lay_out_keyframes(read_camera(lens), supersampling, margin_px)),
        frames_(layout_, {lambda, options_.log_eps}, workers_),
        camera_(options_, layout_.sensor.width, layout_.sensor.height, seed) {}

  nb::object step(TimeNs t, const Plane<float>& irradiance, const Plane<float>& depth, const Matrices& camera,
                  const std::optional<TwoPlanes>& motion, const std::optional<Plane<std::uint16_t>>& objects,
                  const Matrices& object_poses) {
    PosedFrame frame;
    frame.t = t;
    frame.T_world_camera = poses_in(camera, "pose").front();
    frame.T_world_objects = poses_in(object_poses, "object_poses");
    frame.irradiance = image_of(irradiance.data(), irradiance.shape(0), irradiance.shape(1));
    frame.depth = image_of(depth.data(), depth.shape(0), depth.shape(1));
    if (objects) frame.object = image_of(objects->data(), objects->shape(0), objects->shape(1));
    if (motion) {
      const std::size_t height = motion->shape(1), width = motion->shape(2);
      frame.motion_x = image_of(motion->data(), height, width);
      frame.motion_y = image_of(motion->data() + height * width, height, width);
    }
    std::vector<Event> events;
    {
      const nb::gil_scoped_release released;
      frames_.take(std::move(frame), [&](const Segment& segment) {
        camera_.integrate({&segment, 1}, segment.t1, workers_);
      });
      const EventSpan span = camera_.release_until(t);
      events.assign(span.begin(), span.end());
    }
    return bytes_to_numpy(std::move(events));
  }

  /// Width, height and margin (px of the sensor) of frames; the margin may be smaller than asked for.
  nb::tuple layout() const { return nb::make_tuple(layout_.camera.width, layout_.camera.height, layout_.margin_px); }
  nb::tuple size() const { return nb::make_tuple(layout_.sensor.width, layout_.sensor.height); }

  nb::dict statistics() const {
    const FrameReprojectionStatistics& s = frames_.statistics();
    nb::dict result;
    result["frames"] = s.frames, result["reconstructions"] = s.reconstructions;
    result["unseen"] = s.unseen, result["disagreement"] = s.disagreement;
    result["objects"] = s.objects, result["moving"] = s.moving, result["not_rigid"] = s.not_rigid;
    return result;
  }

 private:
  Workers workers_;
  EventCameraOptions options_;
  KeyframeLayout layout_;
  ReprojectedFrames frames_;
  EventCamera camera_;
};

}  // namespace

void bind_sensor(nb::module_& module) {
  nb::class_<Sensor>(module, "Sensor")
      .def(nb::init<const std::vector<std::string>&, int, int, double, const std::vector<std::string>&, std::uint64_t,
                    int>(),
           nb::arg("lens"), nb::arg("supersampling"), nb::arg("margin_px"), nb::arg("lambda_px"), nb::arg("options"),
           nb::arg("seed"), nb::arg("threads"))
      .def("step", &Sensor::step, nb::arg("t"), nb::arg("irradiance").noconvert(), nb::arg("depth").noconvert(),
           nb::arg("camera"), nb::arg("motion").none(), nb::arg("objects").none(), nb::arg("object_poses"))
      .def("layout", &Sensor::layout)
      .def("size", &Sensor::size)
      .def("statistics", &Sensor::statistics);
}

}  // namespace esim::python
