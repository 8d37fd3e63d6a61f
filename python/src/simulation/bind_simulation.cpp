#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/unique_ptr.h>
#include <nanobind/stl/vector.h>

#include "bindings.h"
#include "esim/core/error.h"
#include "events/packet_views.h"
#include "simulation/python_renderer.h"
#include "simulation/scenario.h"
#include "simulation/simulation.h"
#include "simulation/trajectory.h"

namespace esim::python {
namespace {

using NamedTrajectories = std::vector<std::pair<std::string, SharedTrajectory>>;

void make_simulation(Simulation* self, const CheckedScenario& scenario, const std::optional<SharedTrajectory>& body,
                     const nb::object& render, const NamedTrajectories& objects, const std::string& origin, int threads,
                     TimeNs packet, const std::filesystem::path& out, bool force, const std::string& command,
                     const std::string& obstacle, const ImageCacheOptions& images) {
  Substitutes substitutes;
  if (body) substitutes.body = body->motion;
  std::optional<PythonFunction> function;
  if (!render.is_none()) {
    function.emplace(render);
    substitutes.make_renderer = [function](const Camera& camera, const Workers&) {
      return make_python_renderer(*function, camera);
    };
  }
  for (const auto& [name, trajectory] : objects) substitutes.objects.push_back({name, trajectory.motion});
  new (self) Simulation(scenario.value, substitutes, function, origin,
                        {threads, packet, out, force, {command, obstacle}, images});
}

using Matrix = nb::ndarray<const double, nb::shape<4, 4>, nb::c_contig, nb::device::cpu>;

SE3 pose_of(const Matrix& matrix) { return pose_in(matrix.data()); }

/// A scene that several simulations share, and the threads on which they run.
struct SharedScene {
  std::shared_ptr<const LoadedScene> loaded;
  std::unique_ptr<const Workers> workers;
};

/// A simulation whose body moves as push() says, from a pose at the start.
std::unique_ptr<Simulation> make_live(const CheckedScenario& scenario, const Matrix& start, TimeNs interval, int order,
                                      const std::string& origin, int threads, TimeNs packet,
                                      const std::filesystem::path& out, bool force, const std::string& obstacle,
                                      const SharedScene* scene) {
  SimulationOptions options{threads, packet, out, force, {"", obstacle}};
  options.live =
      std::make_shared<OnlineTrajectory>(OnlineMotionOptions{.interval = interval, .order = order}, pose_of(start));
  if (scene != nullptr) options.scene = scene->loaded;
  return std::make_unique<Simulation>(scenario.value, Substitutes{}, std::nullopt, origin, options);
}

using Poses = nb::ndarray<const double, nb::shape<-1, -1, 4, 4>, nb::c_contig, nb::device::cpu>;

/// Moves the bodies of several live simulations through poses, shape (simulations, poses), in parallel. Returns the
/// list of new packets of each.
nb::list step_together(const std::vector<Simulation*>& simulations, const Poses& poses, const SharedScene& scene) {
  if (poses.shape(0) != simulations.size()) throw InternalError("as many rows of poses as simulations are needed");
  const std::size_t count = poses.shape(1);
  std::vector<std::vector<Packet>> packets(simulations.size());
  {
    const nb::gil_scoped_release released;
    scene.workers->for_each(static_cast<int>(simulations.size()), [&](int i) {
      const auto k = static_cast<std::size_t>(i);
      for (std::size_t j = 0; j < count; ++j) simulations[k]->push(pose_in(poses.data() + 16 * (count * k + j)));
      packets[k] = simulations[k]->catch_up();
    });
  }
  for (Simulation* simulation : simulations) simulation->raise_signal();
  nb::list all;
  for (std::size_t i = 0; i < packets.size(); ++i) {
    nb::list own;
    for (Packet& packet : packets[i]) own.append(to_dict(std::move(packet), simulations[i]->info()));
    all.append(own);
  }
  return all;
}

// A renderer often refers to the owner of the simulation: the garbage collector must be able to traverse this cycle.

int traverse(PyObject* self, visitproc visit, void* arg) {
  Py_VISIT(Py_TYPE(self));
  if (!nb::inst_ready(self)) return 0;
  std::optional<PythonFunction>& render = nb::inst_ptr<Simulation>(self)->render();
  if (render) Py_VISIT(render->get().ptr());
  return 0;
}

int clear(PyObject* self) {
  if (!nb::inst_ready(self)) return 0;
  std::optional<PythonFunction>& render = nb::inst_ptr<Simulation>(self)->render();
  if (render) render->clear();
  return 0;
}

PyType_Slot slots[] = {
    {Py_tp_traverse, reinterpret_cast<void*>(traverse)}, {Py_tp_clear, reinterpret_cast<void*>(clear)}, {0, nullptr}};

}  // namespace

void bind_simulation(nb::module_& module) {
  nb::class_<ImageCacheOptions>(module, "ImageCacheOptions")
      .def("__init__",
           [](ImageCacheOptions* self, bool use, const std::filesystem::path& folder, std::uint64_t max_bytes) {
             new (self) ImageCacheOptions{use, folder, max_bytes};
           });
  nb::class_<SharedScene>(module, "SharedScene")
      .def("__init__", [](SharedScene* self, const CheckedScenario& scenario, int threads) {
        const nb::gil_scoped_release released;
        const NoticeHandler ignore = [](const std::string&) {};  // of the scene; simulations give the others
        new (self) SharedScene{load_scene(scenario.value, {ignore, ignore}), std::make_unique<const Workers>(threads)};
      });
  module.def("step_together", &step_together, nb::arg("simulations"), nb::arg("poses"), nb::arg("scene"));
  nb::class_<Simulation>(module, "Simulation", nb::type_slots(slots))
      .def("__init__", &make_simulation, nb::arg("scenario"), nb::arg("trajectory").none(), nb::arg("render").none(),
           nb::arg("objects"), nb::arg("origin"), nb::arg("threads"), nb::arg("packet"), nb::arg("out"),
           nb::arg("force"), nb::arg("command"), nb::arg("obstacle"), nb::arg("images"))
      // Appends the next packet, or None, to a list: a signal that raises in Python on the way back cannot lose it.
      .def("append_next",
           [](Simulation& self, nb::list to) {
             std::optional<Packet> packet = self.next();
             to.append(packet ? nb::object(to_dict(std::move(*packet), self.info())) : nb::none());
           })
      .def_static("live", &make_live, nb::arg("scenario"), nb::arg("start"), nb::arg("interval"), nb::arg("order"),
                  nb::arg("origin"), nb::arg("threads"), nb::arg("packet"), nb::arg("out"), nb::arg("force"),
                  nb::arg("obstacle"), nb::arg("scene").none())
      .def("push", [](Simulation& self, const Matrix& pose) { self.push(pose_of(pose)); })
      .def("close", &Simulation::close)
      .def("info", [](const Simulation& self) { return to_dict(self.info()); })
      .def("warnings", &Simulation::warnings)
      .def("losses", &Simulation::losses)
      .def("report", &Simulation::report);
}

}  // namespace esim::python
