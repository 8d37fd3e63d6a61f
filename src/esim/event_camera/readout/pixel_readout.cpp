#include "esim/event_camera/readout/pixel_readout.h"

#include <algorithm>
#include <functional>
#include <utility>

namespace esim::inline event_camera {
namespace {

// An acknowledgement within this time after its request counts as immediate: the time resolution of real sensors, and a
// hundredth of the refractory period.
constexpr TimeNs kPrompt = kNsPerUs;
constexpr TimeNs kPromptPerRefractory = 100;

}  // namespace

PixelReadout::PixelReadout(const EventCameraOptions& options, int width, int height)
    : readout_(options.readout, height),
      width_(width),
      refractory_(to_ns(options.refractory_period_us * 1e-6)),
      holds_(options.refractory_mode == RefractoryMode::hold),
      tolerance_(std::min(kPrompt, refractory_ / kPromptPerRefractory)),
      packing_(width, height) {
  const std::size_t pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  states_.resize(pixels, 0);
  ignored_.resize(pixels, 0);
  if (!holds_) blind_until_.assign(pixels, kLongAgo);
}

/// The next request up to `watermark`, or null. Skips events in `found` that do not occur.
inline const Event* PixelReadout::next_request(TimeNs watermark) {
  if (!superseded_.empty()) {
    for (; next_ < arrived_.size(); ++next_) {
      const std::uint32_t pixel = index(arrived_[next_]);
      if ((states_[pixel] & kSuperseded) == 0) break;
      --to_come_[pixel];
    }
  }
  const Event* const found = next_ < arrived_.size() ? &arrived_[next_] : nullptr;
  if (again_.empty() || again_.front().t > watermark) return found;
  return found != nullptr && *found < again_.front() ? found : &again_.front();
}

/// Whether the pixel raises this request, which assumes immediate acknowledgements: not while another request of it
/// waits, or in a refractory period in which events are dropped.
inline bool PixelReadout::raises(const Event& request) {
  const std::uint32_t pixel = index(request);
  if (counted_) --to_come_[pixel];
  if (readout_.waiting() > 0 && (states_[pixel] & kRequests) != 0) {
    ++ignored_[pixel];
  } else if (holds_ || request.t >= blind_until_[pixel]) {
    return true;
  }
  if (labels_ != nullptr) labels_->drop(request);
  return false;
}

/// Reads out the requests that are acknowledged immediately: most of them, if the readout is fast enough. Their pixels
/// have already continued.
inline void PixelReadout::read_prompt(TimeNs watermark) {
  if (!holds_ || counted_ || !again_.empty() || !resuming_.empty()) return;
  const std::size_t begin = read_.size();
  const std::size_t count = readout_.serve_singly(arrived_.subspan(next_), watermark + 1, tolerance_, read_);
  for (std::size_t i = 0; i < count; ++i)
    longest_delay_ = std::max(longest_delay_, read_[begin + i].t - arrived_[next_ + i].t);
  if (labels_ != nullptr) labels_->read(arrived_.subspan(next_, count), EventSpan(read_).subspan(begin));
  next_ += count;
}

/// Reads out a request immediately if no other waits, and none arrives before the reader serves it; otherwise false.
inline bool PixelReadout::read_at_once(const Event& request, bool resumed, TimeNs before) {
  const TimeNs t = readout_.service_of_one(request.t);
  if (readout_.waiting() > 0 || t >= before) return false;
  readout_.occupy_with_one(t);
  stamp(request, t);
  // A pixel that was acknowledged immediately has already continued.
  if (resumed || !holds_ || t - request.t > tolerance_) acknowledge(request, t);
  return true;
}

inline void PixelReadout::wait(const Event& request) {
  if (readout_.take(request)) {
    states_[index(request)] |= kRequests;
  } else {
    if (labels_ != nullptr) labels_->drop(request);
    acknowledge(request, request.t);
  }
}

/// Reads out the next row at time t.
void PixelReadout::read_row(TimeNs t) {
  for (const Event& request : readout_.serve()) {
    stamp(request, t);
    acknowledge(request, t);
  }
}

inline void PixelReadout::stamp(const Event& request, TimeNs t) {
  read_.push_back({t, request.x, request.y, request.polarity});
  longest_delay_ = std::max(longest_delay_, t - request.t);
  if (labels_ != nullptr) labels_->read(request, t);
}

/// Lets the pixel continue after its refractory period, if it has not already.
inline void PixelReadout::acknowledge(const Event& request, TimeNs t) {
  const std::uint32_t pixel = index(request);
  const std::uint8_t state = states_[pixel];
  states_[pixel] = state & kSuperseded;
  const bool late = t - request.t > tolerance_, waits = (state & kWaits) != 0;
  if (!holds_) blind_until_[pixel] = t + refractory_;
  if (late || waits) release(pixel, (late ? t : request.t) + refractory_, waits, late);
}

/// Makes a pixel resume at a time that was unknown when its segments were integrated.
void PixelReadout::release(std::uint32_t pixel, TimeNs until, bool waits, bool late) {
  if (late) ++delayed_;
  const std::uint32_t ignored = std::exchange(ignored_[pixel], 0U);
  if (!holds_) return;
  if (!waits) {
    count_found();
    pixels_->take_back(pixel, ignored + to_come_[pixel], until);
    to_draw_.push_back(pixel);
    superseded_.push_back(pixel);
    if (labels_ != nullptr) labels_->drop_unread(pixel);
    states_[pixel] |= kSuperseded;
  }
  pixels_->hold(pixel, until);
  const std::uint32_t segment = history.find(pixel, until);
  if (segment == SegmentHistory::kNone) return;
  resuming_.push_back({segment, pixel});
  first_resumes_ = std::min(first_resumes_, until);
}

/// Counts the unprocessed events in `found` of each pixel.
void PixelReadout::count_found() {
  if (std::exchange(counted_, true)) return;
  to_come_.assign(states_.size(), 0);
  const auto count = [&](const Event& event) { ++to_come_[index(event)]; };
  std::ranges::for_each(arrived_.subspan(next_), count);
  found_->for_each(count);
}

/// Lets pixels resume in past segments, up to their next request or to the last known segment.
void PixelReadout::resume(PixelUpdate& update) {
  update.draw_again(*pixels_, to_draw_);
  to_draw_.clear();
  first_resumes_ = kNoTime;
  while (!resuming_.empty()) {
    std::ranges::sort(resuming_);  // the same order for any number of threads
    for (std::size_t begin = 0, end = 0; begin < resuming_.size(); begin = end) {
      const std::uint32_t segment = resuming_[begin].segment;
      together_.clear();
      for (; end < resuming_.size() && resuming_[end].segment == segment; ++end)
        together_.push_back(resuming_[end].pixel);
      const PastSegment& past = history[segment];
      packing_.origin = past.segment.t0;
      packed_.set_packing(packing_);
      update.resume(*pixels_, past, together_, packed_);
      collect();
      const std::uint32_t next = history.next(segment);
      if (next == SegmentHistory::kNone) continue;
      for (const std::uint32_t pixel : together_) {
        if ((states_[pixel] & kWaits) == 0) still_resuming_.push_back({next, pixel});
      }
    }
    resuming_.swap(still_resuming_);
    still_resuming_.clear();
  }
}

/// Collects the requests of resumed pixels.
void PixelReadout::collect() {
  for (const std::uint64_t packed : packed_.events()) {
    Event& event = again_.emplace_back();
    packing_.unpack(packed, event);
    states_[index(event)] |= kWaits;
    std::ranges::push_heap(again_, std::greater<>());
  }
  packed_.clear();
  if (labels_ != nullptr) labels_->add(packed_.labels);
}

void PixelReadout::advance(PixelArray& pixels, PixelUpdate& update, EventQueue& found, TimeNs watermark,
                           PendingLabels* labels) {
  pixels_ = &pixels, found_ = &found, labels_ = labels;
  arrived_ = found.release_until(watermark);
  next_ = 0;
  counted_ = false;
  read_prompt(watermark);
  const Event* request = next_request(watermark);
  while (true) {
    const TimeNs t = request != nullptr ? request->t : watermark + 1;
    const TimeNs service = readout_.next_service();
    if (service < std::min(t, first_resumes_)) {
      read_row(service);
      read_prompt(watermark);
      request = next_request(watermark);
    } else if (first_resumes_ <= t && !resuming_.empty()) {
      resume(update);
      request = next_request(watermark);
    } else if (request == nullptr) {
      break;
    } else {
      const bool resumed = request == again_.data();
      const Event event = *request;
      if (resumed) {
        std::ranges::pop_heap(again_, std::greater<>());
        again_.pop_back();
      } else {
        ++next_;
      }
      request = next_request(watermark);
      if (!resumed && !raises(event)) continue;
      const TimeNs following = request != nullptr ? request->t : watermark + 1;
      const std::size_t superseded = superseded_.size();
      if (!read_at_once(event, resumed, std::min(first_resumes_, following))) wait(event);
      if (superseded_.size() != superseded) request = next_request(watermark);
    }
  }
  resume(update);
  if (!superseded_.empty()) {
    found.remove_if([&](const Event& event) { return (states_[index(event)] & kSuperseded) != 0; });
    for (const std::uint32_t pixel : superseded_) states_[pixel] &= static_cast<std::uint8_t>(~kSuperseded);
    superseded_.clear();
  }
  history.keep_after(watermark);
}

void PixelReadout::release_until(TimeNs until, std::vector<Event>& out) {
  if (out.empty() && released_ == 0 && !read_.empty() && read_.back().t <= until) return read_.swap(out);
  const auto begin = read_.begin() + static_cast<std::ptrdiff_t>(released_);
  const auto end = std::ranges::upper_bound(begin, read_.end(), until, {}, &Event::t);
  out.insert(out.end(), begin, end);
  released_ = static_cast<std::size_t>(end - read_.begin());
  if (released_ < read_.size()) return;
  read_.clear();
  released_ = 0;
}

}  // namespace esim::inline event_camera
