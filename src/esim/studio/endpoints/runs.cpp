#include <fmt/format.h>

#include <fstream>

#include "esim/scenario/read.h"
#include "esim/studio/editor/scenario_check.h"
#include "esim/studio/endpoints/endpoints.h"

namespace esim::studio {
namespace {

namespace fs = std::filesystem;

Json progress_json(const RunStatus& run) {
  const Progress& p = run.progress;
  const double share =
      p.end > p.start ? static_cast<double>(p.now - p.start) / static_cast<double>(p.end - p.start) : 0;
  return {{"t", p.now},
          {"start", p.start},
          {"end", p.end},
          {"samples", p.samples},
          {"events", p.events},
          {"loading", run.loading},
          {"elapsed_s", p.wall_seconds},
          {"left_s", share > 0 ? Json(p.wall_seconds * (1 - share) / share) : Json()}};
}

/// The error and its option; empty without an error.
Json error_json(const RunStatus& run) {
  Json json = Json::object();
  if (!run.error.empty()) json["error"] = run.error;
  if (const std::string where = option_in(run.error); !where.empty()) json["where"] = where;
  return json;
}

Json run_json(const RunStatus& run, const Roots& roots) {
  Json json{{"id", std::to_string(run.id)},  {"scenario", roots.name_of(run.scenario)},
            {"out", roots.name_of(run.out)}, {"state", name_of(run.state)},
            {"pictures", run.pictures},      {"notices", run.notices}};
  json.update(progress_json(run));
  json.update(error_json(run));
  return json;
}

Response start(const Json& request, const Workshop& workshop) {
  const Roots& roots = workshop.roots;
  const std::string path = text_member(request, "path");
  const fs::path file = roots.existing(path);
  const fs::path usual = file.parent_path() / "out" / file.stem();
  const std::string out_name = text_member(request, "out", roots.name_of(usual));
  const fs::path out = roots.resolve(out_name);
  const bool replace = flag_member(request, "overwrite");
  std::ifstream stream(file, std::ios::binary);
  const std::string yaml{std::istreambuf_iterator<char>(stream), {}};
  const CheckedScenario checked = check_scenario(yaml, file, roots);
  if (!checked.problems.empty() || !checked.scenario) {
    const Json& problem = checked.problems.front();
    throw OptionError(problem["what"], problem["where"], problem["what"]);
  }
  std::error_code error;
  const bool running = workshop.runs.writes_to(out);
  if (running || (fs::exists(out, error) && !replace)) {
    Response response =
        json_response({{"error", out_name + (running ? ": a run is writing there; cancel it, or choose another name"
                                                     : ": exists already; replace it, or choose another name")},
                       {"running", running}});
    response.status = 409;
    return response;
  }
  const int id = workshop.runs.start(*checked.scenario, file, out, replace);
  return json_response({{"id", std::to_string(id)}, {"out", out_name}});
}

int id_of(const Request& request) {
  const std::string& text = request.captured.front();
  constexpr std::size_t kMaxDigits = 8;
  if (text.empty() || text.size() > kMaxDigits || text.find_first_not_of("0123456789") != std::string::npos) return 0;
  return std::stoi(text);
}

RunStatus run_of(const Request& request, const Runs& runs) {
  const auto run = runs.find(id_of(request));
  if (!run) throw HttpError(404, request.path + ": no such run");
  return *run;
}

std::string message(const char* event, const Json& data) {
  return fmt::format("event: {}\ndata: {}\n\n", event, text_of(data));
}

/// First the state, then changes, until the run ends.
Response stream(const Request& request, const Workshop& workshop) {
  const int id = run_of(request, workshop.runs).id;
  struct Sent {
    bool over = false;
    TimeNs t = -1;
    int pictures = -1;
    std::string state;
  };
  Response response;
  response.content_type = "text/event-stream";
  response.stream = [workshop, id, sent = Sent{}]() mutable -> std::optional<std::string> {
    if (sent.over) return std::nullopt;
    const auto run = workshop.runs.find(id);
    if (!run) return std::nullopt;
    std::string text;
    const std::string state(name_of(run->state));
    if (state != sent.state || run->progress.now != sent.t) text += message("progress", run_json(*run, workshop.roots));
    if (run->pictures != sent.pictures && run->pictures > 0) text += message("picture", {{"n", run->pictures}});
    sent.state = state, sent.t = run->progress.now, sent.pictures = run->pictures;
    if (!run->over()) return text;
    sent.over = true;
    const std::string recording = workshop.roots.name_of(run->out);
    if (run->state == RunState::done) return text + message("done", {{"recording", recording}});
    if (run->state == RunState::failed) return text + message("failed", error_json(*run));
    std::error_code error;
    const bool kept = fs::exists(run->out, error);
    return text + message("cancelled", {{"recording", kept ? Json(recording) : Json()}});
  };
  return response;
}

}  // namespace

void add_runs(Router& router, const Workshop& workshop) {
  router.add("POST", "/api/runs",
             [workshop](const Request& request) { return start(parse_object(request.body), workshop); });
  router.add("GET", "/api/runs", [workshop](const Request&) {
    Json all = Json::array();
    for (const RunStatus& run : workshop.runs.list()) all.push_back(run_json(run, workshop.roots));
    return json_response(all);
  });
  router.add("GET", "/api/runs/*", [workshop](const Request& request) {
    return json_response(run_json(run_of(request, workshop.runs), workshop.roots));
  });
  router.add("GET", "/api/runs/*/stream", [workshop](const Request& request) { return stream(request, workshop); });
  router.add("GET", "/api/runs/*/picture.png", [workshop](const Request& request) {
    std::string png = workshop.runs.picture(run_of(request, workshop.runs).id);
    if (png.empty()) throw HttpError(404, "no image yet");
    return png_response(std::move(png));
  });
  router.add("DELETE", "/api/runs/*", [workshop](const Request& request) {
    const RunStatus run = run_of(request, workshop.runs);
    if (!workshop.runs.cancel(run.id)) throw HttpError(409, fmt::format("run {} has already ended", run.id));
    return json_response(run_json(*workshop.runs.find(run.id), workshop.roots));
  });
}

}  // namespace esim::studio
