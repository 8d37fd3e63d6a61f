#include "esim/event_camera/circuit/circuit_readout.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>

namespace esim::inline event_camera {
namespace {

/// The first multiple of `period` at `t` or later.
TimeNs next_multiple(TimeNs t, TimeNs period) {
  const TimeNs multiple = t / period * period;
  return multiple < t ? multiple + period : multiple;
}

}  // namespace

CircuitReadout::CircuitReadout(const ReadoutOptions& options, int width, int height, std::uint64_t seed,
                               std::uint16_t stream)
    : options_(options),
      random_(seed, Purpose::circuit_readout, stream),
      width_(width),
      scan_(to_ns(options.scan_period_us * 1e-6)),
      time_stamp_(std::max<TimeNs>(1, to_ns(options.time_stamp_us * 1e-6))),
      usual_delay_(to_ns(1e-6 * (1 + options.scan_period_us * (options.scan_hold ? 2 : 1) + 8 * options.row_wait_us))),
      row_time_(1e3 * options.row_time_us),
      event_time_(options.rate_mev_per_s > 0 ? 1e3 / options.rate_mev_per_s : 0.0),
      first_(static_cast<std::size_t>(height), kNone),
      readings_(static_cast<std::size_t>(height)),
      waiting_on_(static_cast<std::size_t>(width)),
      due_(static_cast<std::size_t>(height)) {}

/// A gamma distribution of shape 4, ns.
double CircuitReadout::wait_of(std::uint32_t row) {
  if (options_.row_wait_us <= 0) return 0;
  double product = 1;
  for (const std::uint32_t word : random_.bits(row, readings_[row]++)) product *= (word + 0.5) * 0x1p-32;
  const double mean = 1e3 * options_.row_wait_us * (1 + static_cast<double>(rows_.size()) / kRows);
  return -0.25 * mean * std::log(product);
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
    due_[request.y] = static_cast<double>(request.t - epoch_) + wait_of(request.y);
    rows_.push_back(request.y);
  }
  if (free_ == kNone) {
    free_ = static_cast<std::uint32_t>(in_rows_.size());
    in_rows_.push_back({{}, kNone});
  }
  const std::uint32_t at = std::exchange(free_, in_rows_[free_].next);
  in_rows_[at] = {request, std::exchange(first, at)};
  ++waiting_;
  if (request.polarity > 0) ++waiting_on_[request.x];
}

/// Of rows_: the one that is read next. Rows that are due while the arbiter is busy keep the order of their requests.
std::size_t CircuitReadout::next_row() const {
  const auto time_of = [this](std::uint32_t row) { return std::max(due_[row], free_at_); };
  return static_cast<std::size_t>(std::ranges::min_element(rows_, {}, time_of) - rows_.begin());
}

TimeNs CircuitReadout::next_service() const {
  if (rows_.empty()) return kNoTime;
  return epoch_ + static_cast<TimeNs>(std::ceil(std::max(due_[rows_[next_row()]], free_at_)));
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

/// Reads out the next row.
void CircuitReadout::serve(CircuitArray& pixels) {
  const std::size_t next = next_row();
  const std::uint32_t row = rows_[next];
  rows_.erase(rows_.begin() + static_cast<std::ptrdiff_t>(next));
  const double now = std::max(due_[row], free_at_);
  const TimeNs t = epoch_ + static_cast<TimeNs>(std::ceil(now));
  const std::size_t begin = read_.size();
  double count = 0;
  for (std::uint32_t at = std::exchange(first_[row], kNone); at != kNone;) {
    const Event& request = in_rows_[at].request;
    if (request.polarity > 0) --waiting_on_[request.x];
    stamp(pixels, request, t);
    ++count;
    const std::uint32_t following = std::exchange(in_rows_[at].next, free_);
    free_ = std::exchange(at, following);
  }
  std::sort(read_.begin() + static_cast<std::ptrdiff_t>(begin), read_.end());
  if (options_.column_coupling > 0) {
    for (std::size_t i = begin; i < read_.size(); ++i) call_rows(read_[i].x, now);
  }
  waiting_ -= static_cast<std::size_t>(count);
  free_at_ = now + std::max(1.0, row_time_ + event_time_ * count);
}

/// Lets a column call the rows of its waiting ON events.
void CircuitReadout::call_rows(std::uint16_t column, double now) {
  if (waiting_on_[column] == 0) return;
  for (const std::uint32_t row : rows_) {
    if (due_[row] <= now + kCall) continue;
    for (std::uint32_t at = first_[row]; at != kNone; at = in_rows_[at].next) {
      const Event& request = in_rows_[at].request;
      if (request.x != column || request.polarity <= 0) continue;
      const double chance = (random_.bits(row, readings_[row]++)[0] + 0.5) * 0x1p-32;
      if (chance < options_.column_coupling) due_[row] = now + kCall;
      break;
    }
  }
}

void CircuitReadout::advance(CircuitArray& pixels, EventQueue& found, TimeNs watermark, PendingLabels* labels) {
  labels_ = labels;
  const auto known = found.release_until(watermark);
  std::size_t next = 0;
  while (true) {
    const bool has_found = next < known.size();
    const bool from_found = has_found && (requests_.empty() || known[next] < requests_.front());
    const TimeNs t = from_found ? known[next].t : requests_.empty() ? kNoTime : requests_.front().t;
    const TimeNs service = next_service();
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
  if (2 * released_ < read_.size()) return;
  read_.erase(read_.begin(), read_.begin() + static_cast<std::ptrdiff_t>(released_));
  released_ = 0;
}

}  // namespace esim::inline event_camera
