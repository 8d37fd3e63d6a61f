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

/// Of packets that neither their user nor ground truth determines.
inline constexpr double kUsualPacketRate_hz = 30;

/// Everything that was recorded after t0, until t1; the first packet of a recording includes t0.
struct Packet {
  TimeNs t0 = 0, t1 = 0;
  std::vector<CameraPart> cameras;
  std::vector<State> body;
  std::vector<double> objects;  // poses of the moving objects at the times of body
  std::vector<ImuSample> imu;
};

/// Cuts a recording into packets, each of which begins where the one before ends: from the recording's start to its
/// end. No packet is without length, unless the whole recording is one instant. Records of different kinds and cameras
/// may come in any order, as long as know() is right: each goes into the packet of its time.
class PacketSink final : public Sink {
 public:
  /// Packets end where the clock ticks, its tick at the recording's start aside.
  explicit PacketSink(const PeriodicClock& clock);

  void begin(const RecordingInfo& info) override;
  void write(const Record& record) override;
  void end(bool complete) override;

  /// Nothing at or before `t` will be written any more. What is nevertheless goes into the first packet that is left.
  void know(TimeNs t);

  /// Replaces the end that begin() was told, where that was not known: at `t`, or at the last record where that is
  /// later.
  void set_end(TimeNs t);

  TimeNs end() const { return end_; }
  TimeNs reached() const { return reached_; }            ///< the time of the latest record
  TimeNs covered() const { return packets_.back().t1; }  ///< the end of the last packet that there is yet

  bool has_packet() const { return !packets_.empty() && (ended_ || packets_.front().t1 <= known_) && !is_last(); }
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

  /// The packet that `t` belongs to.
  Packet& at(TimeNs t);
  CameraPart& part(int camera, TimeNs t) { return at(t).cameras[static_cast<std::size_t>(camera)]; }

  void begin_packet(TimeNs t0);
  void cover(TimeNs t);

  /// The first packet may yet be the recording's last one, which end() hands out.
  bool is_last() const { return !ended_ && packets_.size() == 1; }

  PeriodicClock clock_;
  std::vector<CameraInfo> cameras_;
  TimeNs end_ = 0, known_ = 0, reached_ = 0;
  TimeNs filled_ = 0;     // the latest time for which anything was put into a packet
  bool written_ = false;  // anything at all
  bool ended_ = false;
  std::deque<Packet> packets_;  // not yet taken, without gaps
};

}  // namespace esim::python
