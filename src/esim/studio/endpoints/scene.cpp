#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>

#include "esim/preview/pictures.h"
#include "esim/scenario/read.h"
#include "esim/studio/editor/scenario_check.h"
#include "esim/studio/endpoints/endpoints.h"
#include "esim/studio/scene_view/first_view.h"
#include "esim/studio/scene_view/page_shapes.h"

namespace esim::studio {
namespace {

constexpr const char* kForgotten = "this scene is no longer loaded; reload the page";
constexpr const char* kKept = "private, max-age=3600";

Json box_json(const Eigen::AlignedBox3d& box) {
  if (box.isEmpty()) return nullptr;
  return {json_of(Eigen::Vector3d(box.min())), json_of(Eigen::Vector3d(box.max()))};
}

Json bounds_of(const StudioScene& scene) {
  Eigen::AlignedBox3d still, all;
  for (std::size_t i = 0; i < scene.file().scene.objects.size(); ++i) {
    const SceneObject& object = scene.file().scene.objects[i];
    Eigen::AlignedBox3d box;
    for (const Eigen::Vector3f& vertex : object.mesh.vertices) box.extend(vertex.cast<double>());
    if (scene.splats()[i]) box.extend(scene.splats()[i]->box);
    all.extend(box);
    if (!object.moves) still.extend(box);
  }
  return box_json(still.isEmpty() ? all : still);
}

/// The box around the static splats without outliers, which are far away in many captures; empty without static splats.
Eigen::AlignedBox3d middle_of(const StudioScene& scene) {
  Eigen::AlignedBox3d box;
  for (std::size_t i = 0; i < scene.splats().size(); ++i) {
    if (scene.splats()[i] && !scene.file().scene.objects[i].moves) box.extend(scene.splats()[i]->middle);
  }
  return box;
}

/// Sets the kind of scene, and the pose of a panorama or a plane in the world.
struct DescribeKind {
  const StudioScene& scene;
  Json& answer;
  void operator()(const MeshRendererOptions&) const { answer["kind"] = "mesh"; }
  void operator()(const SplatsRendererOptions&) const { answer["kind"] = "splats"; }
  void operator()(const PanoramaRendererOptions& panorama) const {
    const Eigen::Vector4d q = panorama.orientation.normalized();
    answer["kind"] = "panorama";
    answer["world"]["panorama"] = {{"orientation", {q.x(), q.y(), q.z(), q.w()}}};
  }
  void operator()(const PlaneRendererOptions& plane) const {
    const SE3 pose = pose_named("renderer.pose", plane.pose);
    const double height_m = plane.width_m * scene.texture_aspect();
    answer["kind"] = "plane";
    answer["world"]["plane"] = {
        {"pose", json_of(pose)}, {"width_m", plane.width_m}, {"height_m", height_m}, {"endless", plane.endless}};
    Eigen::AlignedBox3d box;
    for (const double x : {-0.5, 0.5}) {
      for (const double y : {-0.5, 0.5}) box.extend(pose * Eigen::Vector3d(x * plane.width_m, y * height_m, 0));
    }
    answer["bounds"] = box_json(box);
  }
  void operator()(const auto&) const { answer["kind"] = "sprites"; }  // the page shows only the simulator's images
};

Json cameras_json(const std::vector<CameraInfo>& cameras) {
  Json all = Json::array();
  for (const CameraInfo& camera : cameras) {
    all.push_back({{"name", camera.name},
                   {"width", camera.model.width},
                   {"height", camera.model.height},
                   {"fx", camera.model.fx},
                   {"fy", camera.model.fy},
                   {"cx", camera.model.cx},
                   {"cy", camera.model.cy},
                   {"T_body_camera", json_of(camera.T_body_camera)}});
  }
  return all;
}

/// The answer for a scene in another program, about which nothing is known before rendering.
Json engine_json(const Scenario& scenario) {
  return {{"kind", "engine"},        {"glb", nullptr},    {"texture", nullptr},
          {"triangles", 0},          {"bounds", nullptr}, {"cameras", cameras_json(cameras_of(scenario, {}))},
          {"objects", Json::array()}};
}

/// A camera of the scene file, or a view of the scene.
SE3 start_of(const StudioScene& scene) {
  const SceneFile& file = scene.file();
  if (!file.cameras.empty()) return file.cameras.front().motion.front().T_world_object;
  const Eigen::AlignedBox3d splats = middle_of(scene);
  return splats.isEmpty() ? first_view(file.scene) : first_view_of_splats(splats);
}

Json splats_json(const std::optional<PageSplats>& splats, const std::string& address) {
  if (!splats) return nullptr;
  return {{"file", address},
          {"shown", splats->shown},
          {"all", splats->all},
          {"filter", kEnumNames<SplatFilter>[static_cast<std::size_t>(splats->filter)]}};
}

/// How an object deforms, on a clock that starts with the body's trajectory; null if it is rigid.
Json shapes_json(const SceneObject& object, const std::string& address) {
  if (!object.deformation) return nullptr;
  const TimeSpan span = object.deformation->span();
  return {{"file", address},
          {"vertices", object.mesh.vertices.size()},
          {"rate_hz", kShapesPerSecond},
          {"start", span.start},
          {"end", span.end}};
}

constexpr std::string_view kEnvironment = "environment.light";

Json environment_json(const StudioScene& scene, const std::string& base) {
  const auto& light = scene.environment();
  if (!light) return nullptr;
  return {{"file", fmt::format("{}/{}", base, kEnvironment)}, {"width", light->width}, {"height", light->height}};
}

Json scene_json(const Scenario& scenario, SceneStore& scenes) {
  if (engine_objects(scenario.renderer) != nullptr) return engine_json(scenario);
  const auto scene = scenes.of(scenario);
  const std::string base = "/api/scenes/" + scene->id();
  Json answer{{"kind", ""},
              {"glb", scene->glb() ? Json(base + ".glb") : Json()},
              {"texture", scene->texture() ? Json(base + ".jpg") : Json()},
              {"triangles", scene->triangles()},
              {"bounds", bounds_of(*scene)},
              {"middle", box_json(middle_of(*scene))},
              {"environment", environment_json(*scene, base)}};
  std::visit(DescribeKind{*scene, answer}, scenario.renderer);
  answer["cameras"] = cameras_json(cameras_of(scenario, scene->file()));
  answer["start"] = json_of(start_of(*scene));
  answer["objects"] = Json::array();
  for (std::size_t i = 0; i < scene->file().scene.objects.size(); ++i) {
    const SceneObject& object = scene->file().scene.objects[i];
    answer["objects"].push_back({{"name", object.name},
                                 {"glb_node", scene->glb() ? scene->glb()->nodes[i] : ""},
                                 {"moving", object.moves},
                                 {"shapes", shapes_json(object, fmt::format("{}/{}.shapes", base, i))},
                                 {"splats", splats_json(scene->splats()[i], fmt::format("{}/{}.splat", base, i))}});
  }
  return answer;
}

Response scene_file(const Request& request, SceneStore& scenes) {
  const std::string& name = request.captured.front();
  const std::size_t dot = std::min(name.find('.'), name.size());
  const auto scene = scenes.find(name.substr(0, dot));
  if (scene == nullptr) throw HttpError(404, kForgotten);
  Response response;
  response.content_type = content_type_of(name);
  response.headers = {{"Cache-Control", kKept}};
  if (name.ends_with(".glb") && scene->glb()) {
    response.body = scene->glb()->bytes;
  } else if (name.ends_with(".jpg") && scene->texture()) {
    response.body = *scene->texture();
  } else {
    throw HttpError(404, request.path + ": no such file");
  }
  return response;
}

std::optional<std::size_t> number_in(std::string_view text) {
  std::size_t number = 0;
  const auto [end, failure] = std::from_chars(text.data(), text.data() + text.size(), number);
  return failure == std::errc() && end == text.data() + text.size() ? std::optional(number) : std::nullopt;
}

/// Numbers of the query: the first shape, and how many.
Response shapes_of(const Request& request, const Deformation& deformation, std::size_t vertices) {
  const auto number = [&](const char* name, double low, double high) {
    const auto found = request.query.find(name);
    const auto value = number_in(found == request.query.end() ? "" : found->second);
    if (!value || static_cast<double>(*value) < low || static_cast<double>(*value) > high)
      throw HttpError(400, fmt::format("{}: must be a number from {} to {}", name, low, high));
    return *value;
  };
  constexpr double kMaxShape = 1e9;  // a year
  const std::size_t first = number("first", 0, kMaxShape);
  const std::size_t most =
      std::max<std::size_t>(1, kMaxShapeBytes / (kShapeVertexBytes * std::max<std::size_t>(1, vertices)));
  Response response;
  response.headers = {{"Cache-Control", kKept}};
  response.content_type = content_type_of(request.captured[1]);
  response.body =
      page_shapes(deformation, static_cast<std::int64_t>(first), number("count", 1, static_cast<double>(most)));
  return response;
}

/// A texture of a mesh in full resolution, the splats or the shapes of an object, or the environment.
Response scene_part(const Request& request, SceneStore& scenes) {
  constexpr std::string_view kSplats = ".splat", kShapes = ".shapes";
  const auto scene = scenes.find(request.captured[0]);
  if (scene == nullptr) throw HttpError(404, kForgotten);
  std::string_view name = request.captured[1];
  Response response;
  response.headers = {{"Cache-Control", kKept}};
  if (name == kEnvironment && scene->environment()) {
    response.content_type = content_type_of(request.captured[1]);
    response.body = scene->environment()->halves;
    return response;
  }
  if (name.ends_with(kSplats)) {
    name.remove_suffix(kSplats.size());
    const auto index = number_in(name);
    if (!index || *index >= scene->splats().size() || !scene->splats()[*index])
      throw HttpError(404, request.path + ": no such splats");
    response.content_type = content_type_of(request.captured[1]);
    response.body = scene->splats()[*index]->bytes;
    return response;
  }
  if (name.ends_with(kShapes)) {
    name.remove_suffix(kShapes.size());
    const auto index = number_in(name);
    const std::vector<SceneObject>& objects = scene->file().scene.objects;
    if (!index || *index >= objects.size() || !objects[*index].deformation)
      throw HttpError(404, request.path + ": no such shapes");
    return shapes_of(request, *objects[*index].deformation, objects[*index].mesh.vertices.size());
  }
  const auto index = number_in(name);
  const auto image = index ? scene->image(*index) : nullptr;
  if (image == nullptr) throw HttpError(404, request.path + ": no such texture");
  response.content_type = image->type;
  response.body = image->bytes;
  return response;
}

SE3 pose_in(const Json& numbers) {
  constexpr std::size_t kNumbers = 7;
  std::array<double, kNumbers> p{};
  bool sound = numbers.is_array() && numbers.size() == kNumbers;
  for (std::size_t i = 0; i < kNumbers && sound; ++i) {
    sound = numbers[i].is_number();
    if (sound) p[i] = numbers[i].get<double>();
    sound = sound && std::abs(p[i]) < 1e9;
  }
  const Eigen::Quaterniond q(p[6], p[3], p[4], p[5]);
  if (!sound || !(q.norm() > 1e-6)) throw HttpError(400, "pose: must be [x, y, z, qx, qy, qz, qw]");
  return {q.normalized(), {p[0], p[1], p[2]}};
}

/// The camera of a request; by default the first.
CameraInfo camera_in(const Json& request, const std::vector<CameraInfo>& cameras) {
  const std::string name = text_member(request, "camera", cameras.front().name);
  for (const CameraInfo& camera : cameras) {
    if (camera.name == name) return camera;
  }
  throw HttpError(400, name + ": the rig has no camera with this name");
}

/// The image of a camera at a time of the motion, or from a given pose.
Response view(const Json& request, const Workshop& workshop) {
  constexpr double kMaxPixels = 4096, kMaxTime_ns = 9e15;
  const bool free = request.contains("pose") && !request["pose"].is_null();
  const Scenario scenario = scenario_of(request, workshop.roots, free ? ScenarioNeeds::scene : ScenarioNeeds::motion);
  const auto scene = workshop.scenes.of(scenario);
  const CameraInfo info = camera_in(request, cameras_of(scenario, scene->file()));
  Camera camera = info.model;
  if (!scene->on_sensor()) {
    const auto width = static_cast<int>(number_member(request, "width", camera.width, 16, kMaxPixels));
    const double height = std::round(static_cast<double>(camera.height) * width / camera.width);
    camera = scaled(camera, width, static_cast<int>(std::clamp(height, 1.0, kMaxPixels)));
  }
  RenderRequest look;
  std::optional<StudioMotion> motion;
  try {
    motion = motion_of(scenario, scene->file());
  } catch (const UserError&) {
    if (!free) throw;
  }
  if (motion) {
    const double start = static_cast<double>(motion->simulated.start);
    const auto t = static_cast<TimeNs>(number_member(request, "t", start, -kMaxTime_ns, kMaxTime_ns));
    look.t = std::clamp(t, motion->body->start(), motion->body->end());
    look.camera = rigidly_attached(motion->body->at(look.t), info.T_body_camera);
    const TimeNs within = std::clamp(look.t, motion->simulated.start, motion->simulated.end);
    for (const auto& object : motion->objects) look.objects.push_back(object->at(within));
    if (std::ranges::any_of(scene->file().scene.objects, &SceneObject::deforms))
      look.t = within - motion->body->start();  // from where pictures count
  } else {
    for (const SceneMotion& object : scene->file().motions) look.objects.push_back({object.front().T_world_object});
    look.objects.resize(
        static_cast<std::size_t>(std::count_if(scene->file().scene.objects.begin(), scene->file().scene.objects.end(),
                                               [](const SceneObject& o) { return o.moves; })));
  }
  if (free) look.camera = Kinematics{pose_in(request["pose"])};
  return png_response(encode_png(scene->render(camera, look)));
}

}  // namespace

void add_scenes(Router& router, const Workshop& workshop) {
  router.add("POST", "/api/scene", [workshop](const Request& request) {
    const Json body = parse_object(request.body);
    return json_response(scene_json(scenario_of(body, workshop.roots, ScenarioNeeds::scene), workshop.scenes));
  });
  router.add("GET", "/api/scenes/*",
             [workshop](const Request& request) { return scene_file(request, workshop.scenes); });
  router.add("GET", "/api/scenes/*/*",
             [workshop](const Request& request) { return scene_part(request, workshop.scenes); });
  router.add("POST", "/api/view",
             [workshop](const Request& request) { return view(parse_object(request.body), workshop); });
}

}  // namespace esim::studio
