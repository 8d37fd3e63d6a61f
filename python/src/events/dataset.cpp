#include "esim/dataset/generators/affine_sequences.h"

#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <cstddef>
#include <utility>

#include "arrays.h"
#include "bindings.h"
#include "esim/core/error.h"
#include "esim/scenario/conversion.h"

namespace esim::python {
namespace {

/// Two images as one array of shape (2, height, width).
nb::object pair_to_numpy(const Image<float>& first, const Image<float>& second) {
  std::vector<float> values(first.pixels().begin(), first.pixels().end());
  values.insert(values.end(), second.pixels().begin(), second.pixels().end());
  return to_numpy(std::move(values),
                  {2, static_cast<std::size_t>(first.height()), static_cast<std::size_t>(first.width())});
}

MotionFieldTime motion_field_time(const std::string& name) {
  if (name == "start") return MotionFieldTime::start;
  if (name == "middle") return MotionFieldTime::middle;
  if (name == "end") return MotionFieldTime::end;
  throw UserError("motion_field_at: must be start, middle or end, not " + name);
}

nb::tuple make(const AffineSequences& sequences, std::uint32_t index) {
  Sequence sequence = [&] {
    const nb::gil_scoped_release released;
    return sequences.make(index);
  }();
  return nb::make_tuple(bytes_to_numpy(std::move(sequence.events)), sequence.span.end - sequence.span.start,
                        sequence.motion_field_t, pair_to_numpy(sequence.motion_field.x, sequence.motion_field.y),
                        pair_to_numpy(sequence.optical_flow.x, sequence.optical_flow.y),
                        pair_to_numpy(sequence.first, sequence.last), sequence.info);
}

}  // namespace

void bind_dataset(nb::module_& module) {
  nb::class_<AffineSequences>(module, "AffineSequences")
      .def(
          "__init__",
          [](AffineSequences* self, const std::string& images, int width, int height, double duration_s,
             std::uint64_t seed, double min_threshold, double max_threshold, const std::string& histogram,
             double flow_scale, const std::string& motion_field_at, const std::vector<std::string>& event_camera) {
            AffineOptions options;
            options.images = images;
            options.width = width, options.height = height;
            options.duration_s = duration_s;
            options.seed = seed;
            options.contrast_threshold = {min_threshold, max_threshold};
            if (!histogram.empty()) options.magnitudes = read_magnitudes(histogram);
            options.flow_scale = flow_scale;
            options.motion_field_at = motion_field_time(motion_field_at);
            options.event_camera = read_event_camera(event_camera, "");
            new (self) AffineSequences(std::move(options));
          },
          nb::arg("images"), nb::arg("width"), nb::arg("height"), nb::arg("duration_s"), nb::arg("seed"),
          nb::arg("min_threshold"), nb::arg("max_threshold"), nb::arg("histogram"), nb::arg("flow_scale"),
          nb::arg("motion_field_at"), nb::arg("event_camera"))
      .def("make", &make, nb::arg("index"));
}

}  // namespace esim::python
