#pragma once

#include <cstdint>
#include <deque>
#include <vector>

#include "arrays.h"
#include "esim/record/record.h"
#include "esim/truth/clock.h"

namespace esim::python {

/// What one camera recorded in a step of time. Images lie one after the other.
struct CameraPart {
  std::vector<Event> events;
  std::vector<float> event_points;

  // Ground truth.
  std::vector<TimeNs> t;
  std::vector<double> poses;
  std::vector<float> irradiance, depth, flow;  // flow: x, then y
  std::vector<std::uint16_t> object;
  std::vector<TimeNs> displacement_span;  // t0, t1
  std::vector<float> displacement;        // x, then y
  std::vector<std::uint8_t> visible;

  // Of the frame camera.
  std::vector<TimeNs> image_t, exposure_start, exposure;
  std::vector<std::uint16_t> images;
  int image_bits = 8;

  std::vector<TimeNs> trigger_t;
  std::vector<std::uint8_t> trigger_kind;
};

/// Everything that was recorded in a step of time: after t0 until t1, both included in the first one.
struct Packet {
  TimeNs t0 = 0, t1 = 0;
  std::vector<CameraPart> cameras;
  std::vector<State> body;
  std::vector<double> objects;  // poses of the moving objects at the times of body
  std::vector<ImuSample> imu;
};

/// Cuts a recording into packets. They end where `clock` ticks, its first tick at the recording's start aside, and at
/// the recording's end.
class PacketSink final : public Sink {
 public:
  explicit PacketSink(const PeriodicClock& clock);

  void begin(const RecordingInfo& info) override;
  void write(const Record& record) override;
  void end(bool complete) override;

  /// Nothing at or before `t` will be written any more.
  void know(TimeNs t);

  bool has_packet() const { return !ready_.empty(); }
  Packet take();

 private:
  void write(const EventsRecord& record);
  void write(const TruthRecord& record);
  void write(const DisplacementRecord& record);
  void write(const EventPointsRecord& record);
  void write(const ImageRecord& record);
  void write(const FrameRecord& record);
  void write(const PoseRecord& record);
  void write(const ImuRecord& record);
  void write(const TriggerRecord& record);

  /// Throws UserError unless the image is as large as the camera's, since a packet's images make one array.
  template <typename T>
  void require_size(const Image<T>& image, int camera, TimeNs t) const;

  /// Makes the open packet the one that `t` belongs to.
  void advance_to(TimeNs t);
  void close_packet();
  void open_packet(TimeNs t0);
  CameraPart& part(int camera) { return open_.cameras[static_cast<std::size_t>(camera)]; }

  PeriodicClock clock_;
  std::vector<CameraInfo> cameras_;
  TimeNs end_ = 0, known_ = 0;
  Packet open_;
  std::deque<Packet> ready_;
};

}  // namespace esim::python
