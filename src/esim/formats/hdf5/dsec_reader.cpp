#include <algorithm>
#include <cstdlib>
#include <limits>
#include <utility>

#include "esim/core/error.h"
#include "esim/formats/hdf5/dsec.h"
#include "esim/formats/hdf5/event_blocks.h"
#include "esim/formats/hdf5/event_columns.h"
#include "esim/formats/hdf5/input.h"
#include "esim/formats/hdf5/label_datasets.h"

namespace esim::inline formats {
namespace {

constexpr std::uint64_t kReadBlock = 1 << 16;

std::optional<int> extent(const hdf5::Input& file, const char* name) {
  const auto value = file.integer_attribute(name);
  if (!value) return std::nullopt;
  if (*value < 1 || *value > 65536)
    file.fail(std::string(name) + " must be from 1 to 65536 px, not " + std::to_string(*value) + " px");
  return static_cast<int>(*value);
}

TimeUnit read_unit(const hdf5::Input& file) {
  const auto unit = file.text_attribute("unit");
  if (!unit || *unit == "us") return TimeUnit::us;
  if (*unit != "ns") file.fail("the unit of time is \"" + *unit + "\", but must be us or ns");
  return TimeUnit::ns;
}

}  // namespace

struct EventsHdf5Reader::Impl {
  explicit Impl(std::filesystem::path path) : file(std::move(path)) {}

  void open();
  TimeNs to_ns(std::int64_t t) const;
  std::int64_t stored_time(std::uint64_t index) const;
  std::int64_t index_end() const;
  std::uint64_t first_at_or_after(TimeNs t) const;
  std::pair<std::uint64_t, std::uint64_t> index_hint(std::int64_t stored) const;

  hdf5::Input file;
  hdf5::Column t, x, y, p;
  std::optional<hdf5::Column> ms_to_idx;
  std::optional<hdf5::LabelColumns> labels;
  std::uint64_t size = 0;
  std::optional<int> width, height;
  TimeUnit unit = TimeUnit::us;
  std::int64_t ns_per_unit = kNsPerUs;
  std::int64_t t_offset = 0;  // in the unit
  std::optional<bool> complete;
};

void EventsHdf5Reader::Impl::open() {
  width = extent(file, "width");
  height = extent(file, "height");
  unit = read_unit(file);
  ns_per_unit = unit == TimeUnit::us ? kNsPerUs : 1;
  t_offset = file.scalar("t_offset").value_or(0);
  if (std::abs(t_offset / 2) > std::numeric_limits<TimeNs>::max() / ns_per_unit / 4)
    file.fail("t_offset is " + std::to_string(t_offset) + ", which is too large for a time");
  if (const auto flag = file.integer_attribute("esim_complete")) complete = *flag != 0;
  if (!file.has("events/t"))
    file.fail("there is no dataset events/t, as in DSEC's layout; the file holds " + file.contents());
  t = file.open_column("events/t");
  x = file.open_column("events/x");
  y = file.open_column("events/y");
  p = file.open_column("events/p");
  if (file.has(hdf5::kLabels)) labels.emplace(file);
  if (file.has("ms_to_idx")) ms_to_idx = file.open_column("ms_to_idx");

  // A killed writer may leave columns of different lengths: their common part is valid.
  size = std::min({t.size, x.size, y.size, p.size});
  bool equal = t.size == size && x.size == size && y.size == size && p.size == size;
  if (labels) {
    const auto [count, all] = labels->size();
    equal = equal && all && count == size;
    size = std::min<std::uint64_t>(size, count);
  }
  if (!equal && complete.value_or(true)) file.fail("the datasets in the group events differ in length");
}

TimeNs EventsHdf5Reader::Impl::to_ns(std::int64_t stored) const {
  std::int64_t time = 0;
  if (__builtin_add_overflow(stored, t_offset, &time) || __builtin_mul_overflow(time, ns_per_unit, &time)) {
    file.fail("the time " + std::to_string(stored) + " is too large");
  }
  return time;
}

std::int64_t EventsHdf5Reader::Impl::stored_time(std::uint64_t index) const {
  std::int64_t value = 0;
  file.read(t, index, std::span(&value, 1));
  return value;
}

// The time of the last entry of ms_to_idx, in units.
std::int64_t EventsHdf5Reader::Impl::index_end() const {
  if (!ms_to_idx || ms_to_idx->size == 0) return 0;
  std::int64_t end = 0;
  if (__builtin_mul_overflow(ms_to_idx->size - 1, kNsPerMs / ns_per_unit, &end)) file.fail("ms_to_idx is too long");
  return end;
}

// The range [first, second] in which, by ms_to_idx, the first event at or after a stored time is.
std::pair<std::uint64_t, std::uint64_t> EventsHdf5Reader::Impl::index_hint(std::int64_t stored) const {
  const std::int64_t units_per_ms = kNsPerMs / ns_per_unit;
  if (!ms_to_idx || ms_to_idx->size == 0) return {0, size};
  const std::uint64_t ms =
      std::min<std::uint64_t>(static_cast<std::uint64_t>(stored / units_per_ms), ms_to_idx->size - 1);
  std::uint64_t first = 0, last = size;
  file.read(*ms_to_idx, ms, std::span(&first, 1));
  if (ms + 1 < ms_to_idx->size) file.read(*ms_to_idx, ms + 1, std::span(&last, 1));
  last = std::min(last, size);
  return {std::min(first, last), last};
}

std::uint64_t EventsHdf5Reader::Impl::first_at_or_after(TimeNs time) const {
  // Times in units since t_offset. Stored times were rounded down, so they stand for the start of their unit.
  std::int64_t since_ns = 0;
  if (__builtin_sub_overflow(time, t_offset * ns_per_unit, &since_ns)) return time < 0 ? 0 : size;
  if (since_ns <= 0) return 0;
  const std::int64_t stored = (since_ns - 1) / ns_per_unit + 1;

  auto [first, last] = index_hint(stored);
  const std::uint64_t hint_first = first, hint_last = last;
  while (first < last) {
    const std::uint64_t middle = first + (last - first) / 2;
    if (stored_time(middle) < stored) {
      first = middle + 1;
    } else {
      last = middle;
    }
  }
  const bool too_early = first == hint_last && first < size && stored_time(first) < stored;
  const bool too_late = first == hint_first && first > 0 && stored_time(first - 1) >= stored;
  if (too_early || too_late) file.fail("ms_to_idx does not match the event times");
  return first;
}

EventsHdf5Reader::EventsHdf5Reader(std::filesystem::path path) : impl_(std::make_unique<Impl>(std::move(path))) {
  impl_->open();
}

EventsHdf5Reader::~EventsHdf5Reader() {
  const hdf5::Quiet quiet;
  impl_.reset();
}

EventsHdf5Reader::EventsHdf5Reader(EventsHdf5Reader&&) noexcept = default;
EventsHdf5Reader& EventsHdf5Reader::operator=(EventsHdf5Reader&&) noexcept = default;

std::uint64_t EventsHdf5Reader::size() const { return impl_->size; }
std::optional<int> EventsHdf5Reader::width() const { return impl_->width; }
std::optional<int> EventsHdf5Reader::height() const { return impl_->height; }
TimeUnit EventsHdf5Reader::unit() const { return impl_->unit; }
TimeNs EventsHdf5Reader::t_offset() const { return impl_->to_ns(0); }
std::optional<bool> EventsHdf5Reader::complete() const { return impl_->complete; }

std::optional<TimeSpan> EventsHdf5Reader::time_span() const {
  if (impl_->size == 0) return std::nullopt;
  return TimeSpan{impl_->to_ns(impl_->stored_time(0)), impl_->to_ns(impl_->stored_time(impl_->size - 1))};
}

TimeNs EventsHdf5Reader::end() const {
  const Impl& impl = *impl_;
  std::int64_t stored = impl.index_end();
  if (impl.size > 0) stored = std::max(stored, impl.stored_time(impl.size - 1));
  return impl.to_ns(stored);
}

std::vector<Event> EventsHdf5Reader::read(std::uint64_t first, std::uint64_t count) const {
  const Impl& impl = *impl_;
  if (first >= impl.size) return {};
  count = std::min(count, impl.size - first);
  std::vector<Event> events;
  std::vector<std::int64_t> t(std::min(count, kReadBlock)), x(t.size()), y(t.size());
  std::vector<std::int64_t> p(t.size());
  const std::int64_t x_end = impl.width.value_or(65536), y_end = impl.height.value_or(65536);

  for (std::uint64_t done = 0; done < count; done += t.size()) {
    for (auto* column : {&t, &x, &y, &p}) column->resize(std::min(count - done, kReadBlock));
    impl.file.read(impl.t, first + done, std::span(t));
    impl.file.read(impl.x, first + done, std::span(x));
    impl.file.read(impl.y, first + done, std::span(y));
    impl.file.read(impl.p, first + done, std::span(p));
    for (std::size_t i = 0; i < t.size(); ++i) {
      if (x[i] < 0 || x[i] >= x_end || y[i] < 0 || y[i] >= y_end) {
        impl.file.fail("event " + std::to_string(first + done + i) + " at (" + std::to_string(x[i]) + ", " +
                       std::to_string(y[i]) + ") is outside the image");
      }
      events.push_back({impl.to_ns(t[i]), static_cast<std::uint16_t>(x[i]), static_cast<std::uint16_t>(y[i]),
                        static_cast<std::int8_t>(p[i] > 0 ? 1 : -1)});
    }
  }
  return events;
}

EventsHdf5Reader::IndexRange EventsHdf5Reader::find(TimeNs t0, TimeNs t1) const {
  const std::uint64_t first = impl_->first_at_or_after(t0);
  return {first, t1 <= t0 ? first : std::max(first, impl_->first_at_or_after(t1))};
}

std::vector<Event> EventsHdf5Reader::read_window(TimeNs t0, TimeNs t1) const {
  const IndexRange range = find(t0, t1);
  return read(range.first, range.end - range.first);
}

std::uint64_t EventsHdf5Reader::count_on() const {
  std::uint64_t on = 0;
  for (std::uint64_t done = 0; done < impl_->size; done += kReadBlock) {
    const std::vector<std::int8_t> p = read_polarities(done, kReadBlock);
    on += static_cast<std::uint64_t>(std::count_if(p.begin(), p.end(), [](std::int8_t value) { return value > 0; }));
  }
  return on;
}

std::vector<std::int8_t> EventsHdf5Reader::read_polarities(std::uint64_t first, std::uint64_t count) const {
  if (first >= impl_->size) return {};
  std::vector<std::int8_t> p(std::min(count, impl_->size - first));
  impl_->file.read(impl_->p, first, std::span(p));
  return p;
}

bool EventsHdf5Reader::has_labels() const { return impl_->labels.has_value(); }

void EventsHdf5Reader::read_labels(std::uint64_t first, std::uint64_t count, std::vector<EventLabel>& labels) const {
  const auto to_ns = [&](std::int64_t t) { return impl_->to_ns(t); };
  for (const std::uint64_t end = first + count; first < end; first += kReadBlock)
    impl_->labels->read(impl_->file, first, std::min(kReadBlock, end - first), to_ns, labels);
}

std::vector<std::uint64_t> EventsHdf5Reader::ms_to_idx() const {
  if (!impl_->ms_to_idx) return {};
  std::vector<std::uint64_t> index(impl_->ms_to_idx->size);
  impl_->file.read(*impl_->ms_to_idx, 0, std::span(index));
  if (!std::is_sorted(index.begin(), index.end())) impl_->file.fail("ms_to_idx must not decrease");
  for (std::uint64_t& first : index) first = std::min(first, impl_->size);
  return index;
}

namespace {

class WholeFile final : public EventBlocksReader {
 public:
  explicit WholeFile(const std::filesystem::path& path) : reader_(path) {}

  SensorSize sensor() const override { return {reader_.width().value_or(0), reader_.height().value_or(0)}; }
  std::optional<TimeNs> start() const override { return reader_.t_offset(); }
  std::optional<TimeNs> end() const override { return reader_.end(); }

  bool has_labels() const override { return reader_.has_labels(); }
  void read_labels(std::vector<EventLabel>& labels) override {
    const std::uint64_t first = std::exchange(labelled_, read_);
    reader_.read_labels(first, read_ - first, labels);
  }

 private:
  std::uint64_t event_count() const override { return reader_.size(); }
  void read_block(std::uint64_t first, std::uint64_t count, std::vector<Event>& events) override {
    const std::vector<Event> block = reader_.read(first, count);
    events.insert(events.end(), block.begin(), block.end());
    read_ = first + block.size();
  }

  EventsHdf5Reader reader_;
  std::uint64_t read_ = 0, labelled_ = 0;  // events, labels
};

}  // namespace

Format dsec_format() {
  return {
      .name = "dsec",
      .description = "HDF5 in DSEC's layout",
      .extensions = {".h5", ".hdf5"},
      .holds = {Content::events, Content::event_labels},
      .either_unit = true,
      .recognises = [](const auto&, std::string_view head) { return is_hdf5(head); },
      .open = [](const auto& path,
                 const ReadOptions& options) { return make_events_source(std::make_unique<WholeFile>(path), options); },
      .create =
          [](const auto& path, const WriteOptions& options) {
            return std::make_unique<EventsHdf5Writer>(path, 0, EventsHdf5Options{options.unit, options.compression});
          },
  };
}

}  // namespace esim::inline formats
