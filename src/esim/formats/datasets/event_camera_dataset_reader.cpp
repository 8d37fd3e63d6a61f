#include "esim/formats/datasets/event_camera_dataset_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <exception>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "esim/core/error.h"
#include "esim/files/line_reader.h"
#include "esim/files/number_text.h"
#include "esim/formats/datasets/event_camera_dataset_files.h"
#include "esim/formats/images/png_file.h"
#include "esim/formats/text/events_text.h"

namespace esim::inline formats {
namespace {

constexpr std::size_t kPortion = 1 << 16;  // events
constexpr std::size_t kMaxImageBytes = std::size_t{1} << 28;
constexpr double kLargestNormError = 0.01;  // of a quaternion; some files have few digits

LineReader lines_of(const FilesInput& files, const std::string& name) {
  return LineReader(files.open(name), files.path_of(name), files.size(name));
}

/// Lines that start with a time, in order of time.
class TimedLines {
 public:
  explicit TimedLines(LineReader lines) : lines_(std::move(lines)) {}

  /// Goes to the next line; returns false at the end.
  bool next() {
    std::string_view line;
    while (lines_.next(line)) {
      std::string_view rest = line;
      const std::string_view word = take_word(rest);
      if (word.empty() || word[0] == '#') continue;
      TimeNs t = 0;
      if (!parse_seconds(word, t)) fail(fmt::format("\"{}\" is not a time in seconds", word));
      if (const std::string_view problem = problem_of_time(t_, t); !problem.empty()) fail(std::string(problem));
      t_ = t;
      rest_ = rest;
      return true;
    }
    return false;
  }

  TimeNs t() const { return *t_; }

  /// The next word of the line. Fails at its end.
  std::string_view word() {
    const std::string_view word = take_word(rest_);
    if (word.empty()) fail("the line has too few columns");
    return word;
  }

  double number() {
    const std::string_view text = word();
    double value = 0;
    if (!parse_number(text, value) || !std::isfinite(value)) fail(fmt::format("\"{}\" is not a finite number", text));
    return value;
  }

  Eigen::Vector3d vector() {
    const double x = number(), y = number();
    return {x, y, number()};
  }

  [[noreturn]] void fail(const std::string& reason) const { lines_.fail(reason); }

 private:
  LineReader lines_;
  std::optional<TimeNs> t_;
  std::string_view rest_;  // of the line
};

/// One kind of record. Keeps the next record ready.
class Part {
 public:
  virtual ~Part() = default;

  /// Time of the next record; nothing at the end. If a call throws, later calls throw too.
  virtual std::optional<TimeNs> look_ahead() = 0;

  /// The record whose time look_ahead() returned.
  virtual void take(std::optional<Record>& record) = 0;
};

class EventsPart final : public Part {
 public:
  explicit EventsPart(const FilesInput& files) : reader_(lines_of(files, kEventsTxt)) {}

  std::optional<TimeNs> look_ahead() override {
    if (!ready_ && damage_) std::rethrow_exception(damage_);
    if (!ready_) read();
    return ready_ ? std::optional(events_.front().t) : std::nullopt;
  }

  void take(std::optional<Record>& record) override {
    record.emplace(EventsRecord{0, events_});
    ready_ = false;
  }

  double progress() const { return reader_.progress(); }

 private:
  void read() {
    try {
      ready_ = reader_.read(events_, kPortion);
    } catch (const UserError&) {
      damage_ = std::current_exception();
      ready_ = !events_.empty();
      if (!ready_) throw;
    }
  }

  EventsTextReader reader_;
  std::vector<Event> events_;
  bool ready_ = false;
  std::exception_ptr damage_;
};

/// A text with one record per line.
class LinesPart : public Part {
 public:
  LinesPart(const FilesInput& files, const char* name) : lines_(lines_of(files, name)) {}

  std::optional<TimeNs> look_ahead() final {
    if (!ready_) ready_ = lines_.next();
    return ready_ ? std::optional(lines_.t()) : std::nullopt;
  }

  void take(std::optional<Record>& record) final {
    ready_ = false;
    parse(record, lines_);
  }

 protected:
  virtual void parse(std::optional<Record>& record, TimedLines& lines) = 0;

 private:
  TimedLines lines_;
  bool ready_ = false;
};

class FramesPart final : public LinesPart {
 public:
  explicit FramesPart(const FilesInput& files) : LinesPart(files, kImagesTxt), files_(files) {}

 private:
  void parse(std::optional<Record>& record, TimedLines& lines) override {
    const std::string name(lines.word());
    const std::filesystem::path path(name);
    const bool leaves = std::find(path.begin(), path.end(), "..") != path.end();
    if (path.is_absolute() || leaves || !files_.has(name)) {
      lines.fail(fmt::format("the image {} is missing from the dataset", name));
    }
    const std::string shown = files_.path_of(name).string();
    if (files_.size(name) > kMaxImageBytes) throw UserError(fmt::format("cannot read {}: it is too large", shown));
    std::string bytes(static_cast<std::size_t>(files_.size(name)), '\0');
    bytes.resize(files_.open(name)(std::as_writable_bytes(std::span(bytes))));
    auto png = decode_grey_png(bytes);
    if (!png) throw UserError(fmt::format("cannot read {}: it is not a PNG, or it is damaged", shown));
    image_ = std::move(*png);
    record.emplace(
        FrameRecord{.t = lines.t(), .exposure_start = lines.t(), .image = image_.channels[0], .bits = image_.bits});
  }

  const FilesInput& files_;
  PngImage image_;
};

class ImuPart final : public LinesPart {
 public:
  explicit ImuPart(const FilesInput& files) : LinesPart(files, kImuTxt) {}

 private:
  void parse(std::optional<Record>& record, TimedLines& lines) override {
    ImuRecord imu{.t = lines.t()};
    imu.measured.specific_force = lines.vector();
    imu.measured.angular_rate = lines.vector();
    record.emplace(imu);
  }
};

class PosesPart final : public LinesPart {
 public:
  explicit PosesPart(const FilesInput& files) : LinesPart(files, kGroundTruthTxt) {}

 private:
  void parse(std::optional<Record>& record, TimedLines& lines) override {
    PoseRecord pose{.t = lines.t()};
    pose.body.T_world_body.translation = lines.vector();
    const Eigen::Vector3d q = lines.vector();
    const Eigen::Quaterniond rotation(lines.number(), q.x(), q.y(), q.z());
    if (std::abs(rotation.norm() - 1) > kLargestNormError) lines.fail("the quaternion must have unit norm");
    pose.body.T_world_body.rotation = rotation.normalized();
    record.emplace(pose);
  }
};

void read_calibration(const FilesInput& files, Camera& camera) {
  LineReader lines = lines_of(files, kCalibTxt);
  std::string_view line;
  lines.next(line);
  RadialTangential distortion;
  const std::array<double*, 9> numbers = {&camera.fx,     &camera.fy,     &camera.cx,     &camera.cy,    &distortion.k1,
                                          &distortion.k2, &distortion.p1, &distortion.p2, &distortion.k3};
  for (double* number : numbers) {
    const std::string_view word = take_word(line);
    if (!parse_number(word, *number) || !std::isfinite(*number)) lines.fail("expected fx fy cx cy k1 k2 p1 p2 k3");
  }
  const bool straight = std::all_of(numbers.begin() + 4, numbers.end(), [](const double* k) { return *k == 0; });
  if (!straight) camera.distortion = distortion;
}

class Dataset final : public Source {
 public:
  Dataset(std::unique_ptr<FilesInput> files, const ReadOptions& options);

  const RecordingInfo& info() const override { return info_; }
  double progress() const override { return events_->progress(); }
  const Record* next() override;

 private:
  template <typename Kind>
  void add_if_there(const char* name) {
    if (files_->has(name)) parts_.push_back(std::make_unique<Kind>(*files_));
  }
  void read_first_frame(const ReadOptions& options);

  std::unique_ptr<FilesInput> files_;
  RecordingInfo info_;
  std::vector<std::unique_ptr<Part>> parts_;
  EventsPart* events_ = nullptr;  // points to one of the parts
  std::optional<Record> record_;
  bool ended_ = false;
};

Dataset::Dataset(std::unique_ptr<FilesInput> files, const ReadOptions& options) : files_(std::move(files)) {
  if (!files_->has(kEventsTxt))
    throw UserError("cannot read " + files_->path_of(kEventsTxt).string() + ": it is missing");
  CameraInfo& camera = info_.cameras.emplace_back();
  camera.name = "cam0";
  camera.has_frames = files_->has(kImagesTxt);
  if (files_->has(kCalibTxt)) read_calibration(*files_, camera.model);
  auto events = std::make_unique<EventsPart>(*files_);
  events_ = events.get();
  parts_.push_back(std::move(events));
  add_if_there<FramesPart>(kImagesTxt);
  add_if_there<ImuPart>(kImuTxt);
  add_if_there<PosesPart>(kGroundTruthTxt);
  if (files_->has(kImuTxt)) info_.imu.emplace();
  read_first_frame(options);

  std::optional<TimeNs> start;
  for (const auto& part : parts_) {
    try {
      const auto t = part->look_ahead();
      if (t) start = std::min(start.value_or(*t), *t);
    } catch (const UserError&) {  // next() reports it
    }
  }
  info_.start = info_.end = start.value_or(0);
  info_.start_known = false;
}

/// The first image determines the size of the sensor.
void Dataset::read_first_frame(const ReadOptions& options) {
  Camera& model = info_.cameras.front().model;
  if (options.sensor) {
    model.width = options.sensor->width, model.height = options.sensor->height;
  } else if (files_->has(kImagesTxt)) {
    try {
      FramesPart frames(*files_);
      if (!frames.look_ahead()) return;
      frames.take(record_);
      const auto& image = std::get<FrameRecord>(*record_).image;
      model.width = image.width(), model.height = image.height();
    } catch (const UserError&) {  // next() reports it
    }
    record_.reset();
  }
}

const Record* Dataset::next() {
  if (std::exchange(ended_, true)) return nullptr;  // also if the following throws
  Part* earliest = nullptr;
  TimeNs start = std::numeric_limits<TimeNs>::max();
  for (const auto& part : parts_) {
    const auto t = part->look_ahead();
    if (t && *t < start) earliest = part.get(), start = *t;
  }
  if (earliest == nullptr) return nullptr;
  earliest->take(record_);
  ended_ = false;
  return &*record_;
}

}  // namespace

std::unique_ptr<Source> open_dataset(std::unique_ptr<FilesInput> files, const ReadOptions& options) {
  return std::make_unique<Dataset>(std::move(files), options);
}

}  // namespace esim::inline formats
