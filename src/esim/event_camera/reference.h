#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <set>
#include <vector>

#include "esim/core/image.h"
#include "esim/core/random.h"
#include "esim/core/time.h"
#include "esim/event_camera/center_surround.h"
#include "esim/event_camera/options.h"
#include "esim/events/event.h"

namespace esim::inline event_camera {

/// The definition of the event camera: one pixel at a time and one event at a time, in double precision, with every
/// effect of EventCameraOptions. The numbers in reference.cpp are those of the equations in docs/methods/pixel.md.
///
/// EventCamera accelerates it, and draws the same random numbers: their events are the same, with times that agree
/// within the rounding of EventCamera's floats. This class is much slower; it serves to read and to test.
class ReferenceEventCamera {
 public:
  ReferenceEventCamera(const EventCameraOptions& options, int width, int height, std::uint64_t seed = 0,
                       std::uint16_t stream = 0);

  /// Takes the irradiance of all pixels at time t (linear, >= 0, 1 = white; times must increase), and returns, in
  /// order, the events since the previous frame. The first frame sets the references. Time stamps include latencies, so
  /// that they may be later than t.
  std::vector<Event> process(const Image<float>& irradiance, TimeNs t);

 private:
  static constexpr TimeNs kNoTime = std::numeric_limits<TimeNs>::max();

  struct Pixel {
    double light = 0, brightness = 0;     // E and L at the previous frame
    double filtered1 = 0, filtered2 = 0;  // after each pole, then
    double reference = 0;                 // R, then; it falls by `leak` per second
    double on = 0, off = 0, leak = 0;     // thresholds, and 1/s; constant between two events
    std::uint32_t draws = 0, shots = 0;   // number of draws for events, and of candidates of shot noise
    TimeNs shot_at = kNoTime;             // next candidate of shot noise
    std::optional<TimeNs> busy_until;     // end of the refractory period; kNoTime while it waits for the readout
    double from = 0;                      // s after the previous frame: nothing is searched before
    std::array<float, 4> normals{};       // n' of the last event: ON, OFF, leak, latency
  };
  struct Signal;  // of a pixel between two frames

  // Signal.
  double brightness(double light) const;
  std::vector<double> brightness_of(const Image<float>& irradiance, TimeNs t);
  double intensity(double light) const;
  Signal signal_of(const Pixel& pixel, double light, double brightness, TimeNs t0, TimeNs t1) const;

  // Events.
  void open(std::size_t i, double light, double brightness, TimeNs t);
  void draw_parameters(std::size_t i);
  void next_shot(Pixel& pixel, double uniform) const;
  bool find_shot(std::size_t i, const Signal& signal, double& tau, int& polarity);
  std::optional<Event> next_event(std::size_t i, const Signal& signal);

  // Time stamps.
  TimeNs delay(const Pixel& pixel, double light) const;
  void read_out(const std::vector<Signal>& signals, std::vector<Event>& events);
  void find_requests(std::size_t i, const Signal& signal);
  void raise(const Event& request, const std::vector<Signal>& signals);
  void serve_row(TimeNs service, const std::vector<Signal>& signals, std::vector<Event>& events);
  void acknowledge(const Event& request, TimeNs t, const std::vector<Signal>& signals);
  std::size_t pixel_of(const Event& event) const;

  EventCameraOptions options_;
  int width_;
  bool holds_;
  TimeNs refractory_;
  std::vector<Pixel> pixels_;
  std::optional<CenterSurround> surround_;
  Image<float> surrounded_;
  AddressedRandom mismatch_, per_event_, leak_, shot_, defects_;
  std::optional<TimeNs> last_t_;

  // The readout: future requests, waiting requests, and the time at which the reader is free.
  std::set<Event> requests_;
  std::vector<Event> waiting_;
  std::vector<TimeNs> blind_until_;
  double free_at_ = -std::numeric_limits<double>::infinity();  // ns after `epoch_`
  TimeNs epoch_ = 0;
};

}  // namespace esim::inline event_camera
