#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <fstream>
#include <iterator>
#include <mutex>

#include "esim/files/output_file.h"
#include "esim/scenario/read.h"
#include "esim/scene/splats/splat_file.h"
#include "esim/studio/editor/scenario_check.h"
#include "esim/studio/editor/schema_json.h"
#include "esim/studio/endpoints/endpoints.h"

namespace esim::studio {
namespace {

namespace fs = std::filesystem;

constexpr std::uintmax_t kMaxBytes = std::uintmax_t{8} << 20;

std::string read(const fs::path& file, const std::string& name) {
  std::error_code error;
  if (!fs::is_regular_file(file, error)) throw HttpError(404, name + ": no such file");
  if (fs::file_size(file, error) > kMaxBytes)
    throw HttpError(413, name + ": is too large; a scenario must have at most 8 MiB");
  std::ifstream stream(file, std::ios::binary);
  std::string text{std::istreambuf_iterator<char>(stream), {}};
  if (!stream) throw UserError(name + ": cannot be read; check its permissions");
  return text;
}

/// The FNV-1a hash of a text.
std::string revision_of(const std::string& text) {
  std::uint64_t hash = 0xcbf29ce484222325U;
  for (const unsigned char byte : text) hash = (hash ^ byte) * 0x100000001b3U;
  return fmt::format("{:016x}-{}", hash, text.size());
}

/// {yaml, values, problems}, also for invalid YAML.
Json checked(const std::string& yaml, const fs::path& file, const Roots& roots) {
  Json answer{{"yaml", yaml}, {"values", Json::object()}, {"problems", Json::array()}};
  try {
    CheckedScenario result = check_scenario(yaml, file, roots);
    answer["values"] = std::move(result.values);
    answer["problems"] = std::move(result.problems);
  } catch (const OptionError& error) {
    answer["problems"].push_back(problem_json(error.key(), error.what(), error.line()));
  } catch (const UserError& error) {
    answer["problems"].push_back(problem_json("", error.what(), 0));
  }
  return answer;
}

std::string new_scenario(const std::string& scene, bool splats) {
  YAML::Emitter name;  // with quotes if they are needed
  name << scene;
  return fmt::format("renderer:\n  type: {}\n  scene: {}\n", splats ? "splats" : "mesh", name.c_str()) +
         "trajectory:\n  type: waypoints\n  speed: 1\n  points: []\n"
         "camera: {width: 346, height: 260, horizontal_fov_deg: 75}\n"
         "event_camera: {contrast_threshold: 0.3}\n";
}

Response save(const Json& request, const Roots& roots) {
  static std::mutex one_at_a_time;  // from the check to the end of writing
  const std::string path = text_member(request, "path"), yaml = text_member(request, "yaml");
  const std::string extension = fs::path(path).extension().string();
  if (extension != ".yaml" && extension != ".yml") throw HttpError(400, path + ": must end in .yaml");
  const fs::path file = roots.resolve(path);
  std::error_code error;
  if (!fs::is_directory(file.parent_path(), error)) throw HttpError(404, path + ": its folder does not exist");
  const auto known = request.find("revision");
  const bool is_new = known == request.end() || known->is_null();

  const std::lock_guard lock(one_at_a_time);
  const bool exists = fs::exists(file, error);
  if (!flag_member(request, "overwrite") && (exists || !is_new)) {
    const std::string there = exists ? read(file, path) : "";
    const std::string revision = exists ? revision_of(there) : "";
    if (is_new || text_member(request, "revision") != revision) {
      Json conflict{{"error", is_new   ? path + ": exists already; replace it, or choose another name"
                              : exists ? path + ": has been changed by another window or program"
                                       : path + ": has been removed"},
                    {"yaml", there},
                    {"revision", revision}};
      Response response = json_response(conflict);
      response.status = 409;
      return response;
    }
  }
  // The temporary file has another name, which may be a link to elsewhere.
  const fs::path temporary = fs::path(file) += ".tmp";
  fs::remove(temporary, error);
  try {
    write_file_atomically(file, yaml);
  } catch (const OutputError&) {
    fs::remove(temporary, error);
    throw;
  }
  sync_directory(file.parent_path());
  return json_response({{"revision", revision_of(yaml)}});
}

}  // namespace

void add_scenarios(Router& router, const Roots& roots) {
  router.add("GET", "/api/schema", [body = text_of(schema_json())](const Request&) {
    Response response;
    response.body = body;
    return response;
  });
  router.add("GET", "/api/presets", [](const Request&) { return json_response(presets_json()); });
  router.add("GET", "/api/scenario", [&roots](const Request& request) {
    const auto path = request.query.find("path");
    if (path == request.query.end()) throw HttpError(400, "path: is missing");
    const fs::path file = roots.existing(path->second);
    const std::string yaml = read(file, path->second);
    Json answer{{"path", path->second}};
    answer["revision"] = revision_of(yaml);
    answer.update(checked(yaml, file, roots));
    return json_response(answer);
  });
  router.add("POST", "/api/scenario/new", [&roots](const Request& request) {
    const Json body = parse_object(request.body);
    const std::string scene = text_member(body, "scene", "");
    const fs::path place = scene.empty() ? roots.list().front().folder / "scene" : roots.existing(scene);
    const std::string yaml = new_scenario(scene.empty() ? "" : place.filename().string(), is_splat_file(place));
    Json answer = checked(yaml, place.parent_path() / "scenario.yaml", roots);
    answer["dir"] = roots.name_of(place.parent_path());
    return json_response(answer);
  });
  router.add("POST", "/api/scenario/check", [&roots](const Request& request) {
    const Json body = parse_object(request.body);
    return json_response(checked(text_member(body, "yaml"), place_of(body, roots), roots));
  });
  router.add("PUT", "/api/scenario",
             [&roots](const Request& request) { return save(parse_object(request.body), roots); });
}

}  // namespace esim::studio
