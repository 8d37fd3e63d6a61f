#include "simulation/python_renderer.h"

#include <nanobind/ndarray.h>

#include <algorithm>

#include "arrays.h"
#include "esim/render/bands.h"
#include "esim/render/motion_field.h"
#include "esim/render/pixel_rays.h"

namespace esim::python {
namespace {

template <typename T>
using Plane = nb::ndarray<const T, nb::ndim<2>, nb::c_contig, nb::device::cpu>;
using TwoPlanes = nb::ndarray<const float, nb::ndim<3>, nb::c_contig, nb::device::cpu>;

nb::object matrix(const SE3& pose) {
  std::vector<double> values;
  append_matrix(pose, values);
  return to_numpy(std::move(values), {4, 4});
}

/// Copies tiles from an image of the same size.
template <typename T>
void copy(const T* from, const std::vector<Tile>& tiles, Image<T>& to) {
  for (const Tile& tile : tiles) {
    for (int y = tile.y; y < tile.y + tile.height; ++y)
      std::copy_n(from + std::ptrdiff_t{y} * to.width() + tile.x, tile.width, to.row(y) + tile.x);
  }
}

class PythonRenderer final : public ProcessorRenderer {
 public:
  PythonRenderer(PythonFunction render, const Camera& camera)
      : render_(std::move(render)), rays_(camera), width_(camera.width), height_(camera.height) {}

  RendererTraits traits() const override {
    RendererTraits traits;
    traits.name = "python";
    traits.granularity = Granularity::frame;
    return traits;
  }

 private:
  void compute(std::span<const RenderRequest> requests, Sample& sample) const override {
    prepare(requests, width_, height_, sample);
    for (const RenderRequest& request : requests) {
      const bool has_motion_field = ask(request, sample);
      if (has_motion_field) continue;
      const std::vector<Twist> twists = relative_twists(request);
      for (const Tile& tile : request.tiles) motion_field(rays_, twists, tile, sample);
    }
  }

  /// Sets irradiance, depth and object; returns true if it also sets the motion field.
  bool ask(const RenderRequest& request, Sample& sample) const {
    const nb::gil_scoped_acquire acquired;
    nb::list objects;
    for (const Kinematics& object : request.objects) objects.append(matrix(object.T_world_body));
    const nb::object rendered =
        render_.get()(request.t, matrix(request.camera.T_world_body), objects, nb::make_tuple(height_, width_));
    copy(nb::cast<Plane<float>>(rendered[0]).data(), request.tiles, sample.irradiance);
    copy(nb::cast<Plane<float>>(rendered[1]).data(), request.tiles, sample.depth);
    const nb::object motion_field = rendered[2], object = rendered[3];
    if (request.wants_objects() && !object.is_none())
      copy(nb::cast<Plane<std::uint16_t>>(object).data(), request.tiles, sample.object);
    if (motion_field.is_none()) return false;
    const auto planes = nb::cast<TwoPlanes>(motion_field);
    copy(planes.data(), request.tiles, sample.motion_x);
    copy(planes.data() + sample.motion_x.size(), request.tiles, sample.motion_y);
    return true;
  }

  PythonFunction render_;
  PixelRays rays_;
  int width_, height_;
};

}  // namespace

PythonFunction::PythonFunction(nb::object function)
    : function_(new nb::object(std::move(function)), [](nb::object* kept) {
        const nb::gil_scoped_acquire acquired;
        delete kept;
      }) {}

std::unique_ptr<Renderer> make_python_renderer(const PythonFunction& render, const Camera& camera) {
  return std::make_unique<PythonRenderer>(render, camera);
}

}  // namespace esim::python
