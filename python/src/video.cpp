#include <fmt/format.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <chrono>
#include <optional>
#include <utility>

#include "arrays.h"
#include "bindings.h"
#include "esim/compose/compose.h"
#include "esim/core/error.h"
#include "esim/scenario/conversion.h"

namespace esim::python {
namespace {

constexpr double kSignalInterval_s = 0.02;

/// The planes of a frame as an array of shape (height, width) or (height, width, 3).
nb::object to_array(const Planes& planes) {
  const auto width = static_cast<std::size_t>(planes[0].width()), height = static_cast<std::size_t>(planes[0].height());
  std::vector<float> values(planes.size() * width * height);
  for (std::size_t plane = 0; plane < planes.size(); ++plane) {
    const std::span<const float> pixels = planes[plane].pixels();
    for (std::size_t i = 0; i < pixels.size(); ++i) values[i * planes.size() + plane] = pixels[i];
  }
  if (planes.size() == 1) return to_numpy(std::move(values), {height, width});
  return to_numpy(std::move(values), {height, width, planes.size()});
}

/// Calls the function of _video.py, which checks the image that it returns.
class PythonFrameInterpolator final : public FrameInterpolator {
 public:
  /// `function` must outlive this object, which is released without the GIL.
  explicit PythonFrameInterpolator(nb::handle function) : function_(function) {}

  std::string name() const override { return "interpolator"; }

  void between(const Frame& frame0, const Frame& frame1, double fraction, Planes& light) override {
    const nb::gil_scoped_acquire acquired;
    const nb::object image = function_(to_array(frame0.planes), to_array(frame1.planes), fraction);
    if (nb::isinstance<nb::str>(image)) throw UserError(nb::cast<std::string>(image));
    const auto values = nb::cast<nb::ndarray<const float, nb::c_contig, nb::device::cpu>>(image);
    const std::size_t count = frame0.planes.size();
    resize(light, frame0.planes[0].width(), frame0.planes[0].height(), count == 3);
    for (std::size_t plane = 0; plane < count; ++plane) {
      const std::span<float> pixels = light[plane].pixels();
      for (std::size_t i = 0; i < pixels.size(); ++i) pixels[i] = values.data()[i * count + plane];
    }
  }

 private:
  nb::handle function_;
};

/// Looks for signals such as that of Ctrl-C from time to time; keeps the exception that their handler raises.
class Signals {
 public:
  bool came() {
    const auto now = std::chrono::steady_clock::now();
    if (std::chrono::duration<double>(now - looked_).count() < kSignalInterval_s) return false;
    looked_ = now;
    const nb::gil_scoped_acquire acquired;
    if (PyErr_CheckSignals() == 0) return false;
    raised_.emplace();
    return true;
  }
  void raise() {
    if (raised_) throw *std::exchange(raised_, std::nullopt);
  }

 private:
  std::chrono::steady_clock::time_point looked_ = std::chrono::steady_clock::now();
  std::optional<nb::python_error> raised_;
};

/// What the options can improve, with the names of esim.video's arguments.
void comment(const ConversionSummary& summary, const Notices& notices) {
  if (summary.held == 0) return;
  notices.warning(
      fmt::format("between {} of {} pairs of frames, the motion is too large for max_steps steps (up to "
                  "{:.0f} px); raise lambda_px or max_steps, or use a video with more frames per second",
                  summary.held, summary.frames - 1, summary.max_optical_flow_px));
}

/// The report, the problem that ended the conversion early, and the warnings.
nb::tuple convert_video(const std::filesystem::path& input, const std::filesystem::path& out, const nb::object& images,
                        const std::string& images_name, const std::vector<std::string>& overrides, int threads,
                        std::uint64_t seed, bool force, std::optional<double> fps, double slow_motion, double start,
                        std::optional<double> duration, int encoding, bool bayer, bool interpolation, double lambda,
                        int max_steps) {
  ConversionOptions options;
  std::error_code error;
  options.input = std::filesystem::absolute(input, error);
  options.seed = seed;
  options.video = {static_cast<Encoding>(encoding), fps, slow_motion, start, duration};
  options.interpolation = {interpolation, lambda, max_steps};
  options.interpolator = images_name;
  options.bayer = bayer;
  options.event_camera = read_event_camera(overrides, "");

  ConversionOutput output;
  output.out = out;
  output.replace = force;
  output.threads = threads;
  output.repetition.obstacle = "a program called esim.video";
  output.comment = comment;
  if (!images.is_none()) output.interpolator = std::make_unique<PythonFrameInterpolator>(images);

  std::vector<std::string> warnings;
  const Notices notices{[&](const std::string& text) { warnings.push_back(text); }, [](const std::string&) {}};
  Signals signals;
  const MadeConversion made = [&] {
    const nb::gil_scoped_release released;
    return make_conversion(options, std::move(output), notices, [&](const Progress&) { return !signals.came(); });
  }();
  signals.raise();
  std::string problem = made.summary.problem;
  if (!problem.empty()) {
    problem += fmt::format("; the {} frames before this error are kept in {}, marked incomplete", made.summary.frames,
                           out.string());
  }
  return nb::make_tuple(made.report, problem, warnings);
}

}  // namespace

void bind_video(nb::module_& module) {
  module.def("convert_video", &convert_video, nb::arg("input"), nb::arg("out"), nb::arg("images").none(),
             nb::arg("images_name"), nb::arg("overrides"), nb::arg("threads"), nb::arg("seed"), nb::arg("force"),
             nb::arg("fps").none(), nb::arg("slow_motion"), nb::arg("start"), nb::arg("duration").none(),
             nb::arg("encoding"), nb::arg("bayer"), nb::arg("interpolation"), nb::arg("lambda"), nb::arg("max_steps"));
}

}  // namespace esim::python
