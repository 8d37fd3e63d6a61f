#include "esim/event_camera/circuit/circuit_readout.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>

namespace esim::inline event_camera {
namespace {

constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

/// The first multiple of `period` at `t` or later.
TimeNs next_multiple(TimeNs t, TimeNs period) {
  const TimeNs multiple = t / period * period;
  return multiple < t ? multiple + period : multiple;
}

}  // namespace

CircuitReadout::CircuitReadout(const ReadoutOptions& options, int width, int height)
    : options_(options),
      width_(width),
      scan_(to_ns(options.scan_period_us * 1e-6)),
      time_stamp_(std::max<TimeNs>(1, to_ns(options.time_stamp_us * 1e-6))),
      usual_delay_(to_ns(1e-6 * (1 + options.scan_period_us * (options.scan_hold ? 2 : 1) + options.row_rest_us +
                                 options.row_scan_us * height))),
      row_time_(1e3 * options.row_time_us),
      event_time_(options.rate_mev_per_s > 0 ? 1e3 / options.rate_mev_per_s : 0.0),
      pass_(1e3 * options.row_scan_us),
      rest_(1e3 * options.row_rest_us),
      first_(static_cast<std::size_t>(height), kNone),
      last_read_(static_cast<std::size_t>(height), std::numeric_limits<double>::lowest()) {}

double CircuitReadout::visit(std::uint32_t row, double t) const {
  const auto rows = static_cast<std::uint32_t>(first_.size());
  t = std::max(t, last_read_[row] + rest_);
  const double first = free_at_ + pass_ * static_cast<double>((row + rows - position_) % rows);
  if (first >= t) return first;
  const double round = pass_ * static_cast<double>(rows);
  return round > 0 ? first + round * std::ceil((t - first) / round) : t;
}

/// The time of the first scan that reports the request.
TimeNs CircuitReadout::scan_time(const Event& request) const {
  const TimeNs phase = scan_ * request.x / width_;
  const TimeNs since = options_.scan_hold ? request.t : request.t - phase;
  return next_multiple(since, scan_) + phase;
}

void CircuitReadout::take(const Event& request) {
  if (epoch_ == kNoTime) epoch_ = request.t;
  std::uint32_t& first = first_[request.y];
  if (first == kNone) {
    rows_.push_back(request.y);
    visits_.push_back(visit(request.y, static_cast<double>(request.t - epoch_)));
  }
  in_rows_.push_back({request, first});
  first = static_cast<std::uint32_t>(in_rows_.size() - 1);
  ++waiting_;
}

/// Stamps a request, and lets its pixel continue.
void CircuitReadout::stamp(CircuitArray& pixels, const Event& request, TimeNs t) {
  const TimeNs time_stamp = next_multiple(t, time_stamp_);
  read_.push_back({time_stamp, request.x, request.y, request.polarity});
  if (labels_ != nullptr) labels_->read(request, time_stamp);
  longest_delay_ = std::max(longest_delay_, t - request.t);
  delayed_ += t - request.t > usual_delay_ ? 1 : 0;
  const auto pixel = static_cast<std::uint32_t>(request.y) * static_cast<std::uint32_t>(width_) +
                     static_cast<std::uint32_t>(request.x);
  const TimeNs resumes = pixels.acknowledge(pixel, t);
  for (std::uint32_t i = history.find(pixel, resumes); i != SegmentHistory::kNone; i = history.next(i)) {
    resumed_.clear();
    pixels.resume(pixel, history[i], buffer_, resumed_);
    if (resumed_.empty()) continue;
    if (labels_ != nullptr) labels_->add(buffer_.labels);
    requests_.push_back(resumed_.front());
    std::ranges::push_heap(requests_, std::greater<>());
    break;
  }
}

/// Reads out the row that is visited first.
void CircuitReadout::serve(CircuitArray& pixels) {
  const auto next = static_cast<std::size_t>(std::ranges::min_element(visits_) - visits_.begin());
  const std::uint32_t row = rows_[next];
  const double now = visits_[next];
  const TimeNs t = epoch_ + static_cast<TimeNs>(std::ceil(now));
  const std::size_t begin = read_.size();
  double count = 0;
  for (std::uint32_t at = std::exchange(first_[row], kNone); at != kNone; at = in_rows_[at].next) {
    stamp(pixels, in_rows_[at].request, t);
    ++count;
  }
  std::sort(read_.begin() + static_cast<std::ptrdiff_t>(begin), read_.end());
  waiting_ -= static_cast<std::size_t>(count);
  if (waiting_ == 0) in_rows_.clear();
  last_read_[row] = now;
  position_ = (row + 1) % static_cast<std::uint32_t>(first_.size());
  free_at_ = now + std::max(1.0, pass_ + row_time_ + event_time_ * count);
  rows_.erase(rows_.begin() + static_cast<std::ptrdiff_t>(next));
  visits_.resize(rows_.size());
  for (std::size_t i = 0; i < rows_.size(); ++i) visits_[i] = visit(rows_[i], now);
}

void CircuitReadout::advance(CircuitArray& pixels, EventQueue& found, TimeNs watermark, PendingLabels* labels) {
  labels_ = labels;
  const auto known = found.release_until(watermark);
  std::size_t next = 0;
  while (true) {
    const bool has_found = next < known.size();
    const bool from_found = has_found && (requests_.empty() || known[next] < requests_.front());
    const TimeNs t = from_found ? known[next].t : requests_.empty() ? kNoTime : requests_.front().t;
    const TimeNs service = rows_.empty() ? kNoTime : epoch_ + static_cast<TimeNs>(std::ceil(std::ranges::min(visits_)));
    if (std::min(t, service) > watermark || std::min(t, service) == kNoTime) break;
    if (service < t) {
      serve(pixels);
      continue;
    }
    Event request;
    if (from_found) {
      request = known[next++];
    } else {
      std::ranges::pop_heap(requests_, std::greater<>());
      request = requests_.back();
      requests_.pop_back();
    }
    if (scan_ > 0) {
      stamp(pixels, request, scan_time(request));
    } else {
      take(request);
    }
  }
  if (scan_ > 0 || time_stamp_ > 1) {  // stamps are not in the order of requests
    std::sort(read_.begin() + static_cast<std::ptrdiff_t>(released_), read_.end());
  }
  history.keep_after(watermark);
}

void CircuitReadout::release_until(TimeNs until, std::vector<Event>& out) {
  const auto begin = read_.begin() + static_cast<std::ptrdiff_t>(released_);
  // A request after `until` may not be stamped before it, so that what is stamped by then is complete.
  const auto end = std::ranges::upper_bound(begin, read_.end(), until, {}, &Event::t);
  out.insert(out.end(), begin, end);
  released_ = static_cast<std::size_t>(end - read_.begin());
  if (released_ < read_.size()) return;
  read_.clear();
  released_ = 0;
}

}  // namespace esim::inline event_camera
