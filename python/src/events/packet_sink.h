#pragma once

#include <cstdint>
#include <deque>
#include <vector>

#include "arrays.h"
#include "esim/recording/record.h"
#include "esim/truth/clock.h"

namespace esim::python {

/// The records of one camera in a packet. Images are stored one after the other.
struct CameraPart {
  std::vector<Event> events;
  std::vector<EventLabel> labels;
  std::vector<float> event_points;

  // Ground truth.
  std::vector<TimeNs> t;
  std::vector<double> poses;
  std::vector<float> irradiance, depth, motion_field;  // motion_field: x, then y
  std::vector<std::uint16_t> object;
  std::vector<TimeNs> optical_flow_span;  // t0, t1
  std::vector<float> optical_flow;        // x, then y
  std::vector<std::uint8_t> visible;

  // Of the frame camera.
  std::vector<TimeNs> image_t, exposure_start, exposure;
  std::vector<std::uint16_t> images;
  int image_bits = 8;

  std::vector<TimeNs> trigger_t;
  std::vector<std::uint8_t> trigger_kind;
};

/// The length of packets if neither the user nor ground truth determines it.
inline constexpr double kUsualPacketRate_hz = 30;

/// The records of t0 < t <= t1; the first packet of a recording includes t0.
struct Packet {
  TimeNs t0 = 0, t1 = 0;
  std::vector<CameraPart> cameras;
  std::vector<State> body;
  std::vector<double> objects;  // poses of the moving objects at the times of body
  std::vector<ImuSample> imu;
};

/// Cuts a recording into consecutive packets from its start to its end. Packets have a positive length, unless the
/// recording is one instant. Records of different kinds and cameras may come in any order, as long as know() is
/// correct: each goes into the packet of its time.
class PacketSink final : public Sink {
 public:
  /// Packets end at the ticks of the clock, except the tick at the recording's start.
  explicit PacketSink(const PeriodicClock& clock);

  void begin(const RecordingInfo& info) override;
  void write(const Record& record) override;
  void end(bool complete) override;

  /// Promises that no record at or before `t` will follow. Late records go into the first remaining packet.
  void know(TimeNs t);

  /// Sets the end if begin() did not know it: `t`, or the last record if that is later.
  void set_end(TimeNs t);

  TimeNs end() const { return end_; }
  TimeNs reached() const { return reached_; }            ///< the time of the latest record
  TimeNs covered() const { return packets_.back().t1; }  ///< the end of the last packet so far

  bool has_packet() const { return !packets_.empty() && (ended_ || packets_.front().t1 <= known_) && !is_last(); }
  Packet take();

 private:
  void write(const EventsRecord& record);
  void write(const TruthRecord& record);
  void write(const OpticalFlowRecord& record);
  void write(const EventPointsRecord& record);
  void write(const ImageRecord& record);
  void write(const FrameRecord& record);
  void write(const PoseRecord& record);
  void write(const ImuRecord& record);
  void write(const TriggerRecord& record);

  /// Throws UserError unless the image has the camera's size, since a packet's images form one array.
  template <typename T>
  void require_size(const Image<T>& image, int camera, TimeNs t) const;

  /// The packet of time `t`.
  Packet& at(TimeNs t);
  CameraPart& part(int camera, TimeNs t) { return at(t).cameras[static_cast<std::size_t>(camera)]; }

  void begin_packet(TimeNs t0);
  void cover(TimeNs t);

  /// Whether the first packet may still be the recording's last one, which end() returns.
  bool is_last() const { return !ended_ && packets_.size() == 1; }

  PeriodicClock clock_;
  std::vector<CameraInfo> cameras_;
  TimeNs end_ = 0, known_ = 0, reached_ = 0;
  TimeNs filled_ = 0;     // the latest time of a record in a packet
  bool written_ = false;  // whether any record was written
  bool ended_ = false;
  std::deque<Packet> packets_;  // not taken yet, without gaps
};

}  // namespace esim::python
