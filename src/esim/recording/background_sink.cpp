#include "esim/recording/background_sink.h"

#include <algorithm>
#include <optional>
#include <vector>
#ifdef __linux__
#include <sys/resource.h>
#endif

namespace esim::inline recording {
namespace {

// Waking a thread takes longer than copying a record, so the thread sleeps until this much is waiting.
constexpr std::size_t kWorthWaking_bytes = std::size_t{64} << 10;

/// An owned copy of a record, and its size.
struct Copy {
  std::function<void(Sink&)> write;
  std::size_t bytes = 0;
};

Copy copy_of(const EventsRecord& record) {
  auto events = std::make_shared<const std::vector<Event>>(record.events.begin(), record.events.end());
  auto labels = std::make_shared<const std::vector<EventLabel>>(record.labels.begin(), record.labels.end());
  return {[camera = record.camera, events, labels](Sink& sink) {
            sink.write(EventsRecord{camera, *events, *labels});
          },
          record.events.size_bytes() + record.labels.size_bytes()};
}

Copy copy_of(const TruthRecord& record) {
  struct Images {
    Image<float> irradiance, depth, motion_x, motion_y;
    std::optional<Image<std::uint16_t>> object;
    std::vector<SE3> T_world_objects;
  };
  auto images = std::make_shared<Images>(Images{record.irradiance,
                                                record.depth,
                                                record.motion_x,
                                                record.motion_y,
                                                {},
                                                {record.T_world_objects.begin(), record.T_world_objects.end()}});
  if (record.object != nullptr) images->object = *record.object;
  return {
      [camera = record.camera, t = record.t, pose = record.T_world_camera,
       images = std::shared_ptr<const Images>(images)](Sink& sink) {
        sink.write(TruthRecord{camera, t, pose, images->irradiance, images->depth, images->motion_x, images->motion_y,
                               images->object ? &*images->object : nullptr, images->T_world_objects});
      },
      4 * record.irradiance.size() * sizeof(float)};
}

Copy copy_of(const OpticalFlowRecord& record) {
  struct Images {
    Image<float> x, y;
    Image<std::uint8_t> visible;
  };
  auto images = std::make_shared<const Images>(Images{record.x, record.y, record.visible});
  return {[camera = record.camera, t0 = record.t0, t1 = record.t1, images](Sink& sink) {
            sink.write(OpticalFlowRecord{camera, t0, t1, images->x, images->y, images->visible});
          },
          2 * record.x.size() * sizeof(float)};
}

Copy copy_of(const EventPointsRecord& record) {
  struct Seen {
    std::vector<Event> events;
    std::vector<Eigen::Vector3f> points;
  };
  auto seen = std::make_shared<const Seen>(
      Seen{{record.events.begin(), record.events.end()}, {record.points.begin(), record.points.end()}});
  return {[camera = record.camera, seen](Sink& sink) {
            sink.write(EventPointsRecord{camera, seen->events, seen->points});
          },
          record.events.size_bytes() + record.points.size_bytes()};
}

Copy copy_of(const ImageRecord& record) {
  auto image = std::make_shared<const Image<float>>(record.irradiance);
  return {[camera = record.camera, t = record.t, image](Sink& sink) {
            sink.write(ImageRecord{camera, t, *image});
          },
          image->size() * sizeof(float)};
}

Copy copy_of(const FrameRecord& record) {
  auto image = std::make_shared<const Image<std::uint16_t>>(record.image);
  return {[camera = record.camera, t = record.t, start = record.exposure_start, duration = record.exposure_duration,
           gain = record.gain, bits = record.bits, image](Sink& sink) {
            sink.write(FrameRecord{camera, t, start, duration, gain, *image, bits});
          },
          image->size() * sizeof(std::uint16_t)};
}

Copy copy_of(const PoseRecord& record) {
  return {[record](Sink& sink) { sink.write(record); }, sizeof record + record.objects.size() * sizeof(Kinematics)};
}

Copy copy_of(const ImuRecord& record) {
  return {[record](Sink& sink) { sink.write(record); }, sizeof record};
}

Copy copy_of(const TriggerRecord& record) {
  return {[record](Sink& sink) { sink.write(record); }, sizeof record};
}

/// Lowers the priority of this thread. The simulation waits for its other threads all the time, but for this one only
/// at the end.
void stand_back() {
#ifdef __linux__
  constexpr int kNicer = 5;
  const int now = getpriority(PRIO_PROCESS, 0);  // of this thread
  static_cast<void>(setpriority(PRIO_PROCESS, 0, now + kNicer));
#endif
}

}  // namespace

BackgroundSink::BackgroundSink(std::unique_ptr<Sink> inner, std::size_t capacity_bytes)
    : inner_(std::move(inner)), capacity_bytes_(capacity_bytes), thread_([this] { work(); }) {}

BackgroundSink::~BackgroundSink() {
  {
    const std::lock_guard lock(mutex_);
    jobs_.clear();  // end() was not called: discard what is waiting
  }
  stop();
}

void BackgroundSink::begin(const RecordingInfo& info) {
  submit({[info](Sink& sink) { sink.begin(info); }, 0});
}

void BackgroundSink::write(const Record& record) {
  Copy copy = std::visit([](const auto& kind) { return copy_of(kind); }, record);
  submit({std::move(copy.write), copy.bytes});
}

void BackgroundSink::end(bool complete) {
  submit({[complete](Sink& sink) { sink.end(complete); }, 0});
  stop();
  if (failure_) std::rethrow_exception(failure_);
}

void BackgroundSink::submit(Job job) {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return waiting_bytes_ <= capacity_bytes_ || failure_; });
  if (failure_) std::rethrow_exception(failure_);
  waiting_bytes_ += job.bytes;
  const bool urgent = job.bytes == 0 || waiting_bytes_ >= std::min(kWorthWaking_bytes, capacity_bytes_);
  jobs_.push_back(std::move(job));
  if (urgent) changed_.notify_all();
}

void BackgroundSink::stop() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
    changed_.notify_all();
  }
  if (thread_.joinable()) thread_.join();
}

void BackgroundSink::work() {
  stand_back();
  std::unique_lock lock(mutex_);
  while (true) {
    changed_.wait(lock, [this] { return !jobs_.empty() || stopping_; });
    if (jobs_.empty() || failure_) return;
    const Job job = std::move(jobs_.front());
    jobs_.pop_front();

    lock.unlock();
    std::exception_ptr failure;
    try {
      job.run(*inner_);
    } catch (...) {
      failure = std::current_exception();
    }
    lock.lock();

    waiting_bytes_ -= job.bytes;
    failure_ = failure;
    changed_.notify_all();
    if (failure_) return;
  }
}

}  // namespace esim::inline recording
