#include "esim/studio/recordings/recording_view.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>

#include "esim/core/error.h"
#include "esim/files/input_file.h"
#include "esim/formats/formats.h"
#include "esim/formats/images/timed_files.h"
#include "esim/formats/recording_folder/folder_streams.h"
#include "esim/formats/recording_folder/recording_folder.h"
#include "esim/formats/text/csv.h"
#include "esim/preview/colours.h"
#include "esim/studio/server/http.h"

namespace esim::studio {
namespace {

namespace fs = std::filesystem;

bool is_file(const fs::path& path) {
  std::error_code error;
  return fs::is_regular_file(path, error);
}

/// The sensor's size if the file does not give it: the extent of the events.
void learn_size(CameraView& camera) {
  constexpr std::uint64_t kBlockEvents = std::uint64_t{1} << 20;
  Camera& model = camera.info.model;
  if (model.width > 0 || camera.events == nullptr) return;
  for (std::uint64_t at = 0; at < camera.events->size(); at += kBlockEvents) {
    for (const Event& event : camera.events->read(at, kBlockEvents)) {
      model.width = std::max(model.width, event.x + 1);
      model.height = std::max(model.height, event.y + 1);
    }
  }
}

template <typename T>
std::vector<T> all_of(RecordStream& stream) {
  std::vector<T> records;
  while (const auto due = stream.due()) records.push_back(std::get<T>(*stream.next(*due)));
  return records;
}

}  // namespace

template <typename Part>
void RecordingView::attempt(const Part& part) {
  try {
    part();
  } catch (const UserError& error) {
    notes_.emplace_back(error.what());
  }
}

bool RecordingView::takes(const fs::path& path) {
  std::error_code error;
  if (!fs::is_directory(path, error)) return format_of(path).name == "dsec";
  if (format_of(path).name != "recording") return false;
  if (is_file(path / "events.txt") && !is_file(path / "events.h5")) return false;
  for (fs::directory_iterator entry(path, error), end; !error && entry != end; entry.increment(error)) {
    if (is_file(entry->path() / "events.txt") && !is_file(entry->path() / "events.h5")) return false;
  }
  return true;
}

RecordingView::RecordingView(const fs::path& path) {
  ReadOptions recovering;
  recovering.recover = [&](const std::string& problem) { notes_.push_back(problem); };
  std::error_code error;
  if (!fs::is_directory(path, error)) {
    cameras_.emplace_back();
    cameras_.back().info.name = "cam0";
    open_events(path, cameras_.back());
    learn_size(cameras_.back());
    return;
  }
  folder_ = fs::canonical(path, error);
  const RecordingInfo info = format_named("recording").open(path, recovering)->info();
  span_ = {info.start, info.end};
  const bool alone = is_camera_folder(path);
  attempt([&] { read_report(path / "report.json"); });
  for (const CameraInfo& camera : info.cameras) {
    const fs::path name = camera.name;
    open_camera(!alone ? path / name : camera.lens < 0 ? path : path / name.filename(), camera);
  }
  if (cameras_.empty()) throw UserError(path.string() + ": has no data that can be shown");
  if (!alone && has_file(path / "imu.csv")) imu_file_ = path / "imu.csv";
  if (!alone && has_file(path / "states.csv")) states_file_ = path / "states.csv";
  std::sort(notes_.begin(), notes_.end());
  notes_.erase(std::unique(notes_.begin(), notes_.end()), notes_.end());
}

bool RecordingView::has_file(const fs::path& file) const {
  std::error_code error;
  const fs::path place = fs::canonical(file, error);
  const bool inside =
      !error && std::mismatch(folder_.begin(), folder_.end(), place.begin(), place.end()).first == folder_.end();
  return inside && is_file(place);
}

std::optional<std::string> RecordingView::bytes_of(const TimedFile& image) const {
  if (!has_file(image.file)) return std::nullopt;
  std::ifstream stream(image.file, std::ios::binary);
  std::string bytes{std::istreambuf_iterator<char>(stream), {}};
  return stream ? std::optional(std::move(bytes)) : std::nullopt;
}

void RecordingView::read_report(const fs::path& file) {
  if (!has_file(file)) return;
  constexpr std::size_t kMaxBytes = std::size_t{1} << 24;
  InputFile input(file);
  const auto bytes = input.read(kMaxBytes);
  const auto* const text = reinterpret_cast<const char*>(bytes.data());
  const auto report = nlohmann::json::parse(text, text + bytes.size(), nullptr, false);
  if (!report.is_object() || !report.contains("status")) return;
  incomplete_ |= report["status"] != "complete";
  if (report.contains("reason") && report["reason"].is_string()) notes_.push_back(report["reason"].get<std::string>());
}

void RecordingView::open_camera(const fs::path& folder, CameraInfo info) {
  CameraView camera;
  camera.info = std::move(info);
  if (has_file(folder / "events.h5")) attempt([&] { open_events(folder / "events.h5", camera); });
  const fs::path lens = camera.info.lens < 0 ? folder : folder.parent_path();  // an event sensor shows its images
  attempt([&] { open_images(lens, camera); });
  if (has_file(lens / "truth.h5")) attempt([&] { open_truth(lens / "truth.h5", camera); });
  camera.samples = has_file(lens / "samples.esim") && has_file(folder_ / "scenario.yaml");
  attempt([&] { learn_size(camera); });
  cameras_.push_back(std::move(camera));
}

void RecordingView::open_events(const fs::path& file, CameraView& camera) {
  EventsHdf5Reader reader(file);
  Camera& model = camera.info.model;
  if (model.width == 0 && reader.width() && reader.height())
    model.width = *reader.width(), model.height = *reader.height();
  incomplete_ |= !reader.complete().value_or(true);
  if (const auto span = reader.time_span()) {
    const bool first = span_.start == 0 && span_.end == 0;
    span_ = first ? *span : TimeSpan{std::min(span_.start, span->start), std::max(span_.end, span->end)};
  }
  camera.events = store_of(std::move(reader));
}

void RecordingView::open_images(const fs::path& folder, CameraView& camera) {
  if (has_file(folder / "frames.csv")) {
    CsvReader list(folder / "frames.csv", 4, 1, incomplete_);
    while (list.next()) {
      camera.images.push_back({list.t(), folder / "frames" / fmt::format("{:06}.png", list.integer(0))});
    }
  } else if (has_file(folder / "images" / kTimedFilesList)) {
    TimedFilesReader list(folder / "images", false, incomplete_);
    while (list.next()) camera.images.push_back({list.span().start, list.file()});
  }
}

void RecordingView::open_truth(const fs::path& file, CameraView& camera) {
  camera.truth = std::make_unique<TruthHdf5Reader>(file);
  for (std::uint64_t i = 0; i < camera.truth->size(); ++i) camera.truth_times.push_back(camera.truth->t(i));
  if (camera.truth_times.empty()) return;
  // The colour scale covers the values of a few frames.
  constexpr std::uint64_t kLooks = 5;
  TruthHdf5Reader::Frame frame;
  for (std::uint64_t look = 0; look < kLooks; ++look) {
    camera.truth->read(look * (camera.truth->size() - 1) / (kLooks - 1), frame);
    if (!frame.depth.empty()) camera.depth_scale.include(frame.depth);
    if (!frame.motion_x.empty()) camera.motion_scale.include(frame.motion_x, frame.motion_y);
  }
  camera.depth = camera.depth_scale.near_m() > 0;
  camera.motion_field = !frame.motion_x.empty();
}

std::unique_ptr<RecordingView> RecordingView::beginning_of(const fs::path& path) {
  constexpr std::uint64_t kMaxEvents = 2'000'000;
  constexpr auto kMaxTime = std::chrono::milliseconds(700);
  const auto start = std::chrono::steady_clock::now();
  std::unique_ptr<RecordingView> view(new RecordingView);
  ReadOptions recovering;
  recovering.recover = [&](const std::string& problem) { view->notes_.push_back(problem); };
  const auto source = open_source(path, recovering);
  const RecordingInfo& info = source->info();
  std::vector<std::vector<Event>> events(info.cameras.size());
  std::uint64_t count = 0;
  TimeNs last = info.end;
  try {
    while (count < kMaxEvents && std::chrono::steady_clock::now() - start < kMaxTime) {
      const Record* const record = source->next();
      if (record == nullptr) break;
      const auto* const seen = std::get_if<EventsRecord>(record);
      if (seen == nullptr) continue;
      auto& all = events[static_cast<std::size_t>(seen->camera)];
      all.insert(all.end(), seen->events.begin(), seen->events.end());
      count += seen->events.size();
      if (!all.empty()) last = std::max(last, all.back().t);
    }
  } catch (const UserError& error) {
    if (count == 0) throw;
    view->notes_.emplace_back(error.what());
  }
  if (count == 0 && !view->notes_.empty()) throw UserError(view->notes_.front());
  view->span_ = {info.start, last};
  for (std::size_t i = 0; i < events.size(); ++i) {
    CameraView& camera = view->cameras_.emplace_back();
    camera.info = info.cameras[i];
    camera.events = store_of(std::move(events[i]));
    learn_size(camera);
  }
  return view;
}

const CameraView& RecordingView::camera(const std::string& name) const {
  for (const CameraView& camera : cameras_) {
    if (name.empty() || camera.info.name == name) return camera;
  }
  throw HttpError(404, fmt::format("the recording has no camera {}", name));
}

std::optional<std::pair<Image<Rgb>, TimeNs>> RecordingView::truth_at(const CameraView& camera, Kind kind,
                                                                     TimeNs t) const {
  if (kind == Kind::depth ? !camera.depth : !camera.motion_field) return std::nullopt;
  const auto& times = camera.truth_times;
  const auto later = std::upper_bound(times.begin(), times.end(), t);
  const std::size_t index = later == times.begin() ? 0 : static_cast<std::size_t>(later - times.begin()) - 1;
  TruthHdf5Reader::Frame frame;
  {
    const std::lock_guard lock(mutex_);
    camera.truth->read(index, frame);
  }
  return std::pair(kind == Kind::depth
                       ? colour_depth(frame.depth, camera.depth_scale.near_m(), camera.depth_scale.far_m())
                       : colour_motion(frame.motion_x, frame.motion_y, camera.motion_scale.full_px_per_s()),
                   times[index]);
}

const std::vector<ImuRecord>& RecordingView::imu() const {
  const std::lock_guard lock(mutex_);
  if (!imu_) imu_ = all_of<ImuRecord>(*imu_stream(imu_file_, imu_file_.parent_path() / "imu_truth.csv", incomplete_));
  return *imu_;
}

const std::vector<PoseRecord>& RecordingView::poses() const {
  const std::lock_guard lock(mutex_);
  if (!poses_) poses_ = all_of<PoseRecord>(*poses_stream(states_file_, {}, incomplete_));
  return *poses_;
}

}  // namespace esim::studio
