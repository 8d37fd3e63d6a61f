#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <span>

#include "esim/plot/theme.h"
#include "esim/preview/pictures.h"
#include "esim/scene/images/image_file.h"
#include "esim/studio/endpoints/endpoints.h"
#include "esim/visualise/event_pictures.h"

namespace esim::studio {
namespace {

constexpr TimeNs kMaxTime = TimeNs{1} << 61;

std::string text_in(const Request& request, const char* name, const std::string& otherwise) {
  const auto found = request.query.find(name);
  return found == request.query.end() ? otherwise : found->second;
}

/// A whole number of the query; fractions are truncated.
std::int64_t number_in(const Request& request, const char* name, std::int64_t otherwise, std::int64_t low,
                       std::int64_t high) {
  const auto found = request.query.find(name);
  if (found == request.query.end() || found->second.empty()) return otherwise;
  char* end = nullptr;
  const double value = std::strtod(found->second.c_str(), &end);
  if (end != found->second.c_str() + found->second.size() || !(std::abs(value) < 9e18))
    throw HttpError(400, fmt::format("{}: must be a number, not '{}'", name, found->second));
  return std::clamp(static_cast<std::int64_t>(value), low, high);
}

struct Asked {
  const SensorPreviews& sensors;
  std::shared_ptr<OpenRecording> recording;
  std::shared_ptr<const RecordingView> view;
};

Asked asked(const Request& request, const Workshop& workshop) {
  auto recording = workshop.recordings.find(request.captured.front());
  auto view = recording->view();
  return {workshop.sensors, std::move(recording), std::move(view)};
}

const CameraView& camera_in(const Request& request, const Asked& asked) {
  return asked.view->camera(text_in(request, "camera", ""));
}

/// The recorded events of a camera, or those of the changed sensor that the request names, with from <= t <= to.
std::shared_ptr<const EventStore> events_of(const Request& request, const Asked& asked, const CameraView& camera,
                                            TimeNs from, TimeNs to) {
  const std::string sensor = text_in(request, "sensor", "");
  if (!sensor.empty()) return store_of(asked.sensors.find(sensor)->events(from, to));
  if (camera.events == nullptr) throw HttpError(404, camera.info.name + ": has no events");
  return {asked.view, camera.events.get()};
}

Json recording_json(const std::string& id, const std::string& path, const OpenRecording& recording) {
  const auto view = recording.view();
  Json json{{"id", id},
            {"path", path},
            {"format", recording.format()},
            {"incomplete", view->incomplete()},
            {"start", view->span().start},
            {"end", view->span().end},
            {"indexing", recording.indexed()}};
  std::string note = recording.problem();
  for (const std::string& one : view->notes()) note += (note.empty() ? "" : "; ") + one;
  if (!note.empty()) json["note"] = note;
  json["cameras"] = Json::array();
  for (const CameraView& camera : view->cameras()) {
    json["cameras"].push_back({{"name", camera.info.name},
                               {"width", camera.info.model.width},
                               {"height", camera.info.model.height},
                               {"events", camera.events == nullptr ? 0 : camera.events->size()},
                               {"T_body_camera", json_of(camera.info.T_body_camera)},
                               {"has",
                                {{"events", camera.events != nullptr},
                                 {"images", !camera.images.empty()},
                                 {"depth", camera.depth},
                                 {"motion_field", camera.motion_field},
                                 {"samples", camera.samples}}}});
    if (camera.depth) json["cameras"].back()["depth_m"] = {camera.depth_scale.near_m(), camera.depth_scale.far_m()};
    if (camera.motion_field) json["cameras"].back()["motion_px_per_s"] = camera.motion_scale.full_px_per_s();
  }
  json["imu"] = view->has_imu();
  json["poses"] = view->has_poses();
  return json;
}

/// The file of the last image at or before `t`, or of the first; null without images.
const TimedFile* image_at(const CameraView& camera, TimeNs t) {
  if (camera.images.empty()) return nullptr;
  const auto later = std::upper_bound(camera.images.begin(), camera.images.end(), t,
                                      [](TimeNs time, const TimedFile& image) { return time < image.t; });
  return later == camera.images.begin() ? &camera.images.front() : &*std::prev(later);
}

/// The background of the events without an image.
Rgb ground_in(const Request& request) {
  const std::string theme = text_in(request, "theme", "dark");
  if (theme != "dark" && theme != "light")
    throw HttpError(400, fmt::format("theme: must be dark or light, not '{}'", theme));
  return (theme == "light" ? kLightTheme : kDarkTheme).ground;
}

/// The background of the events: the image, or a plain colour.
Image<Rgb> background_of(const Request& request, const Asked& asked, const CameraView& camera, TimeNs t) {
  const Camera& model = camera.info.model;
  const TimedFile* const file = text_in(request, "over", "none") == "image" ? image_at(camera, t) : nullptr;
  const auto bytes = file != nullptr ? asked.view->bytes_of(*file) : std::nullopt;
  if (bytes) {
    Planes planes;
    decode_planes(std::as_bytes(std::span(*bytes)), file->file.filename().string(), Encoding::automatic, false, planes);
    const Image<Rgb> image = dimmed(grey(planes.front()));
    if (image.width() == model.width && image.height() == model.height) return image;
  }
  return {model.width, model.height, ground_in(request)};
}

Response picture(const Request& request, const Asked& asked) {
  constexpr std::uint64_t kMaxEvents = std::uint64_t{1} << 22;
  constexpr double kWindowsPerTau = 1.5;
  constexpr TimeNs kTausSeen = 5, kDefaultWindow = 20 * kNsPerMs, kMaxWindow = 3600 * kNsPerSecond;
  const CameraView& camera = camera_in(request, asked);
  const Camera& model = camera.info.model;
  if (model.width == 0) throw HttpError(404, camera.info.name + ": has no events");
  const TimeNs t = number_in(request, "t", asked.view->span().start, -kMaxTime, kMaxTime);
  const TimeNs window = number_in(request, "window", kDefaultWindow, 1, kMaxWindow);
  const std::string view = text_in(request, "view", "counts");
  const bool surface = view == "time_surface";
  const TimeNs shown = surface ? static_cast<TimeNs>(kWindowsPerTau * static_cast<double>(kTausSeen * window)) : window;
  const auto store = events_of(request, asked, camera, t - shown + 1, t);
  EventStore::Range range = store->find(t - shown + 1, t + 1);
  range.first = std::max(range.first, range.end - std::min(range.end, kMaxEvents));
  const std::vector<Event> events = store->read(range.first, range.end - range.first);
  const PictureGrid grid = picture_grid({model.width, model.height}, model.width, model.height);
  Image<Rgb> image;
  if (surface) {
    TimeSurface latest(grid);
    latest.add(events);
    image = latest.draw(t, kWindowsPerTau * static_cast<double>(window), ground_in(request));
  } else if (view == "onoff") {
    image = background_of(request, asked, camera, t);
    for (const Event& event : events) image(event.x, event.y) = event.polarity > 0 ? kOnColour : kOffColour;
  } else if (view == "counts") {
    const EventCounts counts = count_events(events, grid);
    image = render_events(counts.on, counts.off, background_of(request, asked, camera, t));
  } else {
    throw HttpError(400, fmt::format("view: must be one of onoff, counts, time_surface, not '{}'", view));
  }
  Response response = png_response(encode_png(image));
  response.headers = {{"X-Events", std::to_string(events.size())}};
  return response;
}

Response image(const Request& request, const Asked& asked) {
  const CameraView& camera = camera_in(request, asked);
  const TimeNs t = number_in(request, "t", asked.view->span().start, -kMaxTime, kMaxTime);
  const std::string kind = text_in(request, "kind", "image");
  Response response;
  TimeNs seen = 0;
  if (kind == "image") {
    const TimedFile* const file = image_at(camera, t);
    if (file == nullptr) throw HttpError(404, camera.info.name + ": has no images");
    auto bytes = asked.view->bytes_of(*file);
    if (!bytes) throw HttpError(404, file->file.filename().string() + ": cannot be read");
    response = png_response(*std::move(bytes));
    seen = file->t;
  } else if (kind == "depth" || kind == "motion_field") {
    const auto truth = asked.view->truth_at(
        camera, kind == "depth" ? RecordingView::Kind::depth : RecordingView::Kind::motion_field, t);
    if (!truth) throw HttpError(404, fmt::format("{}: has no {}", camera.info.name, kind));
    response = png_response(encode_png(truth->first));
    seen = truth->second;
  } else {
    throw HttpError(400, fmt::format("kind: must be one of image, depth, motion_field, not '{}'", kind));
  }
  response.headers = {{"X-Time-Ns", std::to_string(seen)}};
  return response;
}

void put(std::string& bytes, std::uint64_t value, int count) {
  for (int i = 0; i < count; ++i) bytes += static_cast<char>(value >> (8 * i) & 0xff);
}

Response events(const Request& request, const Asked& asked) {
  constexpr std::int64_t kMaxEvents = 500'000;
  constexpr TimeNs kLongestSpan = 0xffff'ffff;  // ns from the start, in 32 bits
  const CameraView& camera = camera_in(request, asked);
  const TimeNs from = number_in(request, "from", asked.view->span().start, -kMaxTime, kMaxTime);
  const TimeNs to = number_in(request, "to", from + 100 * kNsPerMs, from, from + kLongestSpan);
  const auto max = static_cast<std::uint64_t>(number_in(request, "max", 100'000, 1, kMaxEvents));
  const auto store = events_of(request, asked, camera, from, to);
  const EventStore::Range range = store->find(from, to + 1);
  const std::vector<Event> shown = store->thinned(range, max);
  Response response;
  response.content_type = "application/octet-stream";
  constexpr std::size_t kHead = 24, kEach = 8;
  response.body.reserve(kHead + kEach * shown.size());
  put(response.body, static_cast<std::uint64_t>(from), 8);
  put(response.body, static_cast<std::uint64_t>(to), 8);
  put(response.body, shown.size(), 4);
  put(response.body, std::min<std::uint64_t>(range.end - range.first, 0xffff'ffff), 4);
  for (const Event& event : shown) {
    put(response.body, static_cast<std::uint64_t>(event.t - from), 4);
    put(response.body, event.x, 2);
    put(response.body, (event.y & 0x7fffU) | (event.polarity > 0 ? 0x8000U : 0U), 2);
  }
  return response;
}

Response rate(const Request& request, const Asked& asked) {
  const TimeSpan span = asked.view->span();
  const TimeNs from = number_in(request, "from", span.start, -kMaxTime, kMaxTime);
  const TimeNs to = std::max(from + 1, number_in(request, "to", span.end + 1, -kMaxTime, kMaxTime));
  const auto bins = static_cast<std::size_t>(number_in(request, "bins", 500, 1, 10'000));
  const EventRate counted = events_of(request, asked, camera_in(request, asked), from, to)->rate(from, to, bins);
  Json on = Json::array(), off = on;
  for (std::size_t i = 0; i < counted.on.size(); ++i) {
    const double width_s = to_seconds(counted.edges[i + 1] - counted.edges[i]);
    on.push_back(static_cast<double>(counted.on[i]) / width_s);
    off.push_back(static_cast<double>(counted.off[i]) / width_s);
  }
  return json_response({{"edges", counted.edges}, {"on", on}, {"off", off}});
}

/// The records between two times.
template <typename T>
std::span<const T> part_of(const std::vector<T>& records, const Request& request, const TimeSpan& span) {
  const TimeNs from = number_in(request, "from", span.start, -kMaxTime, kMaxTime);
  const TimeNs to = number_in(request, "to", span.end, -kMaxTime, kMaxTime);
  const auto before = [](const T& record, TimeNs t) { return record.t < t; };
  const auto first = std::lower_bound(records.begin(), records.end(), from, before);
  return {first, std::lower_bound(first, records.end(), std::max(from, to + 1), before)};
}

std::size_t max_in(const Request& request) {
  return static_cast<std::size_t>(number_in(request, "max", 2000, 1, 100'000));
}

/// Reduces more than `count` measurements for drawing: from each interval, the minimum of every axis, at its start, and
/// the maximum, at its end. Mere subsampling would alias vibrations.
std::vector<ImuRecord> envelope(std::span<const ImuRecord> records, std::size_t count) {
  if (records.size() <= count) return {records.begin(), records.end()};
  const std::size_t stretches = std::max<std::size_t>(1, count / 2);
  std::vector<ImuRecord> drawn;
  for (std::size_t i = 0; i < stretches; ++i) {
    const std::size_t first = i * records.size() / stretches, end = (i + 1) * records.size() / stretches;
    ImuRecord min = records[first], max = records[first];
    max.t = records[end - 1].t;
    for (const ImuRecord& record : records.subspan(first, end - first)) {
      for (auto signal : {&InertialSignals::angular_rate, &InertialSignals::specific_force}) {
        min.measured.*signal = (min.measured.*signal).cwiseMin(record.measured.*signal);
        max.measured.*signal = (max.measured.*signal).cwiseMax(record.measured.*signal);
      }
    }
    drawn.push_back(min);
    drawn.push_back(max);
  }
  return drawn;
}

Response imu(const Request& request, const Asked& asked) {
  if (!asked.view->has_imu()) throw HttpError(404, "the recording has no IMU");
  Json t = Json::array(), rates = t, forces = t;
  for (const ImuRecord& record : envelope(part_of(asked.view->imu(), request, asked.view->span()), max_in(request))) {
    t.push_back(record.t);
    rates.push_back(json_of(record.measured.angular_rate));
    forces.push_back(json_of(record.measured.specific_force));
  }
  return json_response({{"t", t}, {"angular_velocity", rates}, {"linear_acceleration", forces}});
}

Response poses(const Request& request, const Asked& asked) {
  if (!asked.view->has_poses()) throw HttpError(404, "the recording has no poses");
  Json t = Json::array(), poses = t;
  const std::span<const PoseRecord> all = part_of(asked.view->poses(), request, asked.view->span());
  const std::size_t kept = std::min(all.size(), max_in(request));
  for (std::size_t i = 0; i < kept; ++i) {
    const PoseRecord& record = all[i * all.size() / kept];
    t.push_back(record.t);
    poses.push_back(json_of(record.body.T_world_body));
  }
  return json_response({{"t", t}, {"poses", poses}});
}

}  // namespace

void add_recordings(Router& router, const Workshop& workshop) {
  router.add("POST", "/api/recordings", [workshop](const Request& request) {
    const std::string path = text_member(parse_object(request.body), "path");
    const std::string id = workshop.recordings.open(workshop.roots.existing(path));
    return json_response(recording_json(id, path, *workshop.recordings.find(id)));
  });
  router.add("GET", "/api/recordings/*", [workshop](const Request& request) {
    const std::string& id = request.captured.front();
    return json_response(recording_json(id, "", *workshop.recordings.find(id)));
  });
  const auto add = [&](const char* name, Response (*answer)(const Request&, const Asked&)) {
    router.add("GET", std::string("/api/recordings/*/") + name,
               [workshop, answer](const Request& request) { return answer(request, asked(request, workshop)); });
  };
  add("picture.png", picture);
  add("image.png", image);
  add("events.bin", events);
  add("rate", rate);
  add("imu", imu);
  add("poses", poses);
}

}  // namespace esim::studio
