#include "python_renderer.h"

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

template <typename T>
void copy(const T* from, Image<T>& to) {
  std::copy_n(from, to.size(), to.data());
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
  void compute(const RenderRequest& request, Sample& sample) const override {
    prepare(request, width_, height_, sample);
    const bool has_flow = ask(request, sample);
    if (has_flow) return;
    for (const Tile& tile : request.tiles) motion_field(rays_, request, tile, sample);
  }

  /// Fills E, Z, and which object is seen; V as well where it returns true.
  bool ask(const RenderRequest& request, Sample& sample) const {
    const nb::gil_scoped_acquire acquired;
    nb::list objects;
    for (const Kinematics& object : request.objects) objects.append(matrix(object.T_world_body));
    const nb::object rendered =
        render_.get()(request.t, matrix(request.camera.T_world_body), objects, nb::make_tuple(height_, width_));
    copy(nb::cast<Plane<float>>(rendered[0]).data(), sample.irradiance);
    copy(nb::cast<Plane<float>>(rendered[1]).data(), sample.depth);
    const nb::object flow = rendered[2], object = rendered[3];
    if (request.wants_objects() && !object.is_none())
      copy(nb::cast<Plane<std::uint16_t>>(object).data(), sample.object);
    if (flow.is_none()) return false;
    const auto planes = nb::cast<TwoPlanes>(flow);
    copy(planes.data(), sample.flow_x);
    copy(planes.data() + sample.flow_x.size(), sample.flow_y);
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
