#include "esim/formats/recording_folder/folder_streams.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <utility>

#include "esim/core/colour/srgb.h"
#include "esim/core/error.h"
#include "esim/formats/images/png_file.h"
#include "esim/formats/images/timed_files.h"
#include "esim/formats/text/csv.h"

namespace esim::inline formats {
namespace {

namespace fs = std::filesystem;

class PosesStream final : public RecordStream {
 public:
  PosesStream(const fs::path& states, const std::vector<fs::path>& objects, bool unfinished)
      : body_(states, kStateColumns, 0, unfinished), unfinished_(unfinished) {
    for (const fs::path& file : objects) objects_.emplace_back(file, kStateColumns, 0, unfinished);
  }

  std::optional<TimeNs> due() override {
    if (!body_.next()) return std::nullopt;
    for (CsvReader& object : objects_) {
      const bool there = object.next();
      if (!there && unfinished_) return std::nullopt;
      if (!there || object.t() != body_.t())
        object.fail(fmt::format("expected the motion at {} ns, as in states.csv", body_.t()));
    }
    return body_.t();
  }

  const Record* next(TimeNs) override {
    PoseRecord pose{body_.t(), motion(body_)};
    if (body_.columns() > kStateColumns) {
      if (body_.columns() < kStateColumns + 6) body_.fail("the line ends within the biases");
      pose.imu_bias = InertialSignals{body_.vector(kStateColumns), body_.vector(kStateColumns + 3)};
    }
    for (const CsvReader& object : objects_) pose.objects.push_back(motion(object));
    return &record_.emplace(std::move(pose));
  }

 private:
  static constexpr std::size_t kStateColumns = 20;

  static Kinematics motion(const CsvReader& line) {
    const Eigen::Quaterniond q(line.value(7), line.value(4), line.value(5), line.value(6));
    if (!(std::abs(q.norm() - 1) < 1e-3)) line.fail("the quaternion must have unit norm");
    return {{q, line.vector(1)}, line.vector(8), line.vector(14), line.vector(11), line.vector(17)};
  }

  CsvReader body_;
  std::vector<CsvReader> objects_;
  bool unfinished_;
  std::optional<Record> record_;
};

class ImuStream final : public RecordStream {
 public:
  ImuStream(const fs::path& measured, const fs::path& biases, bool unfinished)
      : measured_(measured, kColumns, 0, unfinished), unfinished_(unfinished) {
    std::error_code error;
    if (fs::exists(biases, error)) biases_.emplace(biases, kColumns, 0, unfinished);
  }

  std::optional<TimeNs> due() override {
    if (!measured_.next()) return std::nullopt;
    const bool there = !biases_ || biases_->next();
    if (!there && unfinished_) return std::nullopt;
    if (!there || (biases_ && biases_->t() != measured_.t()))
      biases_->fail(fmt::format("expected the biases at {} ns, as in imu.csv", measured_.t()));
    return measured_.t();
  }

  const Record* next(TimeNs) override {
    ImuRecord imu{measured_.t(), signals(measured_)};
    if (biases_) imu.bias = signals(*biases_);
    return &record_.emplace(imu);
  }

 private:
  static constexpr std::size_t kColumns = 7;

  static InertialSignals signals(const CsvReader& line) { return {line.vector(1), line.vector(4)}; }

  CsvReader measured_;
  std::optional<CsvReader> biases_;
  bool unfinished_;
  std::optional<Record> record_;
};

/// Portions end where other streams have earlier records.
class EventsStream final : public RecordStream {
 public:
  EventsStream(std::unique_ptr<Source> events, int camera) : events_(std::move(events)), camera_(camera) {}

  std::optional<TimeNs> due() override {
    while (rest_.events.empty()) {
      const Record* const record = events_->next();
      if (record == nullptr) return std::nullopt;
      rest_ = std::get<EventsRecord>(*record);
      rest_.camera = camera_;
    }
    return rest_.events.front().t;
  }

  const Record* next(TimeNs until) override {
    const auto later = std::ranges::upper_bound(rest_.events, until, {}, &Event::t);
    const std::size_t count = std::max<std::size_t>(1, static_cast<std::size_t>(later - rest_.events.begin()));
    record_.emplace(rest_.part(0, count));
    rest_ = rest_.part(count, rest_.events.size() - count);
    return &*record_;
  }

 private:
  std::unique_ptr<Source> events_;
  int camera_;
  EventsRecord rest_;
  std::optional<Record> record_;
};

class PngFramesStream final : public RecordStream {
 public:
  PngFramesStream(const fs::path& folder, int camera, bool unfinished)
      : folder_(folder), camera_(camera), list_(folder / "frames.csv", 4, 1, unfinished) {}

  std::optional<TimeNs> due() override { return list_.next() ? std::optional(list_.t()) : std::nullopt; }

  const Record* next(TimeNs) override {
    const PngImage png = read_png(folder_ / "frames" / fmt::format("{:06}.png", list_.integer(0)));
    image_ = png.channels.front();
    if (png.channels.size() > 1) {
      for (int y = 0; y < image_.height(); ++y) {
        for (int x = 0; x < image_.width(); ++x) image_(x, y) = png.channels[colour_at(x, y)](x, y);
      }
    }
    // Lists of four columns lack the start of the first row: assume a global shutter.
    const TimeNs exposure = list_.integer(2);
    const bool full = list_.columns() > 4;
    if (list_.columns() == 5) list_.fail("the line has 5 numbers, but needs 6");
    const TimeNs start = full ? list_.integer(4) : list_.t() - exposure / 2;
    const std::int64_t bits = full ? list_.integer(5) : png.bits;
    if (bits < 1 || bits > png.bits) list_.fail(fmt::format("{} bits do not match the image", bits));
    return &record_.emplace(
        FrameRecord{camera_, list_.t(), start, exposure, list_.value(3), image_, static_cast<int>(bits)});
  }

 private:
  fs::path folder_;
  int camera_;
  CsvReader list_;
  Image<std::uint16_t> image_;
  std::optional<Record> record_;
};

/// Optical flow follows the frame at its end.
class TruthStream final : public RecordStream {
 public:
  TruthStream(std::shared_ptr<const TruthHdf5Reader> truth, int camera, ImagesStream* images)
      : truth_(std::move(truth)), camera_(camera), images_(images) {
    if (images_ != nullptr) images_->leave_to_truth([this](TimeNs t) { return shows(t); });
  }

  std::optional<TimeNs> due() override {
    if (optical_flow_due_) return truth_->t(frame_ - 1);
    if (frame_ == truth_->size()) return std::nullopt;
    return truth_->t(frame_);
  }

  const Record* next(TimeNs) override {
    if (std::exchange(optical_flow_due_, false)) {
      truth_->read(frame_ - 2, optical_flow_);
      return &record_.emplace(OpticalFlowRecord{camera_, truth_->t(frame_ - 2), truth_->t(frame_ - 1), optical_flow_.x,
                                                optical_flow_.y, optical_flow_.visible});
    }
    if (damage_) std::rethrow_exception(damage_);
    const TimeNs t = truth_->t(frame_);
    if (frame_ > 0 && t <= truth_->t(frame_ - 1)) {
      throw UserError(fmt::format(
          "ground truth of camera {}: the time of frame {}, {} ns, must be later than that of the frame before it",
          camera_, frame_, t));
    }
    const Image<float>& irradiance = images_ != nullptr ? images_->at(t) : kNoImage;
    try {
      truth_->read(frame_, images_of_frame_);
    } catch (const UserError&) {
      damage_ = std::current_exception();
      if (irradiance.empty()) throw;
      return &record_.emplace(ImageRecord{camera_, t, irradiance});
    }
    ++frame_;
    optical_flow_due_ = frame_ >= 2 && frame_ - 2 < truth_->optical_flows();
    const auto& [T_world_camera, depth, motion_x, motion_y, object, T_world_objects] = images_of_frame_;
    return &record_.emplace(TruthRecord{camera_, t, T_world_camera, irradiance, depth, motion_x, motion_y,
                                        object.empty() ? nullptr : &object, T_world_objects});
  }

 private:
  /// Whether the next frame is at this time and not known to be damaged.
  bool shows(TimeNs t) const { return !damage_ && frame_ < truth_->size() && truth_->t(frame_) == t; }

  static inline const Image<float> kNoImage;

  std::shared_ptr<const TruthHdf5Reader> truth_;
  int camera_;
  ImagesStream* images_;
  std::uint64_t frame_ = 0;        // index of the next frame
  std::exception_ptr damage_;      // damage of that frame, whose image is still handed out
  bool optical_flow_due_ = false;  // optical flow to the previous frame is due
  TruthHdf5Reader::Frame images_of_frame_;
  TruthHdf5Reader::OpticalFlow optical_flow_;
  std::optional<Record> record_;
};

}  // namespace

struct ImagesStream::Impl {
  TimedFilesReader files;
  int camera;
  std::function<bool(TimeNs)> truth_shows{};
  Image<float> image{}, none{};
  std::optional<TimeNs> t{};  // of the image
  std::optional<Record> record{};
};

ImagesStream::ImagesStream(const fs::path& folder, int camera, bool unfinished)
    : impl_(new Impl{TimedFilesReader(folder, false, unfinished), camera}) {}

ImagesStream::~ImagesStream() = default;

std::optional<TimeNs> ImagesStream::due() {
  return impl_->files.next() ? std::optional(impl_->files.span().start) : std::nullopt;
}

const Record* ImagesStream::next(TimeNs) {
  impl_->t.reset();
  const PngImage png = read_png(impl_->files.file());
  if (png.channels.size() != 1)
    throw UserError(fmt::format("cannot read {}: it must be grey, not colour", impl_->files.file().string()));
  impl_->image = decode_srgb(png.channels.front(), png.bits);
  impl_->t = impl_->files.span().start;
  if (impl_->truth_shows && impl_->truth_shows(*impl_->t)) return nullptr;
  return &impl_->record.emplace(ImageRecord{impl_->camera, *impl_->t, impl_->image});
}

const Image<float>& ImagesStream::at(TimeNs t) const { return impl_->t == t ? impl_->image : impl_->none; }

void ImagesStream::leave_to_truth(std::function<bool(TimeNs)> shows) { impl_->truth_shows = std::move(shows); }

std::unique_ptr<RecordStream> poses_stream(const fs::path& states, const std::vector<fs::path>& objects,
                                           bool unfinished) {
  return std::make_unique<PosesStream>(states, objects, unfinished);
}

std::unique_ptr<RecordStream> imu_stream(const fs::path& measured, const fs::path& biases, bool unfinished) {
  return std::make_unique<ImuStream>(measured, biases, unfinished);
}

std::unique_ptr<RecordStream> events_stream(std::unique_ptr<Source> events, int camera) {
  return std::make_unique<EventsStream>(std::move(events), camera);
}

std::unique_ptr<RecordStream> frames_stream(const fs::path& folder, int camera, bool unfinished) {
  return std::make_unique<PngFramesStream>(folder, camera, unfinished);
}

std::unique_ptr<RecordStream> truth_stream(std::shared_ptr<const TruthHdf5Reader> truth, int camera,
                                           ImagesStream* images) {
  return std::make_unique<TruthStream>(std::move(truth), camera, images);
}

}  // namespace esim::inline formats
