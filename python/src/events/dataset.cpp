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

FlowTime flow_time(const std::string& name) {
  if (name == "start") return FlowTime::start;
  if (name == "middle") return FlowTime::middle;
  if (name == "end") return FlowTime::end;
  throw UserError("flow_at: must be start, middle or end, not " + name);
}

nb::tuple make(const AffineSequences& sequences, std::uint32_t index) {
  Sequence sequence = [&] {
    const nb::gil_scoped_release released;
    return sequences.make(index);
  }();
  return nb::make_tuple(bytes_to_numpy(std::move(sequence.events)), sequence.span.end - sequence.span.start,
                        sequence.flow_t, pair_to_numpy(sequence.flow.x, sequence.flow.y),
                        pair_to_numpy(sequence.displacement.x, sequence.displacement.y),
                        pair_to_numpy(sequence.first, sequence.last), sequence.info);
}

}  // namespace

void bind_dataset(nb::module_& module) {
  nb::class_<AffineSequences>(module, "AffineSequences")
      .def(
          "__init__",
          [](AffineSequences* self, const std::string& images, int width, int height, double duration_s,
             std::uint64_t seed, double least_threshold, double greatest_threshold, const std::string& histogram,
             double flow_scale, const std::string& flow_at, const std::vector<std::string>& event_camera) {
            AffineOptions options;
            options.images = images;
            options.width = width, options.height = height;
            options.duration_s = duration_s;
            options.seed = seed;
            options.contrast_threshold = {least_threshold, greatest_threshold};
            if (!histogram.empty()) options.magnitudes = read_magnitudes(histogram);
            options.flow_scale = flow_scale;
            options.flow_at = flow_time(flow_at);
            options.event_camera = read_event_camera(event_camera, "");
            new (self) AffineSequences(std::move(options));
          },
          nb::arg("images"), nb::arg("width"), nb::arg("height"), nb::arg("duration_s"), nb::arg("seed"),
          nb::arg("least_threshold"), nb::arg("greatest_threshold"), nb::arg("histogram"), nb::arg("flow_scale"),
          nb::arg("flow_at"), nb::arg("event_camera"))
      .def("make", &make, nb::arg("index"));
}

}  // namespace esim::python
