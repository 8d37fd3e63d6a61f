#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <utility>

#include "esim/core/error.h"
#include "esim/formats/label_columns.h"
#include "esim/formats/numpy/npy_array.h"

namespace esim::inline formats::numpy {
namespace {

constexpr std::int64_t kMaxColumnExtent = 65536;  // px

class ColumnsReader final : public EventsReader {
 public:
  explicit ColumnsReader(EventColumns columns) : columns_(std::move(columns)), count_(columns_.t.array->count()) {
    if (columns_.labels.size() < kLabelNames.size()) columns_.labels.clear();
    std::vector<const EventColumns::Column*> all{&columns_.t, &columns_.x, &columns_.y, &columns_.p};
    for (const auto& [name, column] : columns_.labels) all.push_back(&column);
    for (const auto* column : all) {
      if (std::find(arrays_.begin(), arrays_.end(), column->array) == arrays_.end()) arrays_.push_back(column->array);
      portion_ = std::min(portion_, std::max<std::size_t>(1, kMaxBufferBytes / column->array->item_bytes()));
      if (!column->array->one_dimension()) column->array->fail("it has more than one dimension");
      if (column->array->count() != count_) column->array->fail("its length differs from that of the other arrays");
    }
  }

  SensorSize sensor() const override { return columns_.sensor; }
  double progress() const override { return count_ > 0 ? static_cast<double>(done_) / static_cast<double>(count_) : 1; }

  bool read(std::vector<Event>& events) override {
    const std::size_t wanted = std::min<std::uint64_t>(portion_, count_ - done_);
    std::size_t there = wanted;
    for (const auto& array : arrays_) there = std::min(there, array->advance(wanted));
    columns_.t.array->times(columns_.t.field, t_);
    columns_.x.array->integers(columns_.x.field, x_);
    columns_.y.array->integers(columns_.y.field, y_);
    columns_.p.array->integers(columns_.p.field, p_);
    for (std::size_t i = 0; i < there; ++i, ++done_) {
      if (t_[i] == Array::kNoNumber || p_[i] == Array::kNoNumber || std::min(x_[i], y_[i]) < 0 ||
          std::max(x_[i], y_[i]) >= kMaxColumnExtent) {
        if (has_labels()) take_labels(i);
        columns_.t.array->fail(fmt::format("event {} has an invalid time, position or polarity", done_));
      }
      events.push_back({t_[i], static_cast<std::uint16_t>(x_[i]), static_cast<std::uint16_t>(y_[i]),
                        static_cast<std::int8_t>(p_[i] > 0 ? 1 : -1)});
    }
    if (has_labels()) take_labels(there);
    if (there < wanted) columns_.t.array->fail(fmt::format("it ends after {} of {} events", done_, count_));
    return there > 0;
  }

  bool has_labels() const override { return !columns_.labels.empty(); }
  void read_labels(std::vector<EventLabel>& labels) override {
    labels.insert(labels.end(), labels_.begin(), labels_.end());
    labels_.clear();
  }

 private:
  static constexpr std::size_t kMaxBufferBytes = 1 << 22;

  /// The labels of the `count` items in memory.
  void take_labels(std::size_t count) {
    std::vector<EventLabel> labels(count);
    const auto column = [&](const char* name) -> const EventColumns::Column& { return columns_.labels.at(name); };
    const auto number = [&](const char* name, std::int64_t end, const auto& set) {
      column(name).array->integers(column(name).field, numbers_);
      for (std::size_t i = 0; i < count; ++i) {
        if (numbers_[i] < 0 || numbers_[i] >= end)
          column(name).array->fail(
              fmt::format("the {} of event {} must be a whole number from 0 to {}", name, done_ - count + i, end - 1));
        set(labels[i], numbers_[i]);
      }
    };
    column("t_ideal").array->times(column("t_ideal").field, numbers_);
    for (std::size_t i = 0; i < count; ++i) {
      if (numbers_[i] == Array::kNoNumber)
        column("t_ideal").array->fail(fmt::format("the label of event {} has an invalid time", done_ - count + i));
      labels[i].t_ideal = numbers_[i];
    }
    for (const auto& [name, part] : kLabelParts) {
      column(name).array->floats(column(name).field, parts_);
      for (std::size_t i = 0; i < count; ++i) labels[i].*part = parts_[i];
    }
    for (const auto& [name, surface] : kLabelSurfaces) {
      number(name, 65536, [member = surface](EventLabel& label, std::int64_t value) {
        label.*member = static_cast<std::uint16_t>(value);
      });
    }
    number("cause", static_cast<std::int64_t>(kEnumNames<EventCause>.size()),
           [](EventLabel& label, std::int64_t value) { label.cause = static_cast<EventCause>(value); });
    number("hot", 2, [](EventLabel& label, std::int64_t value) { label.hot = static_cast<std::uint8_t>(value); });
    labels_.insert(labels_.end(), labels.begin(), labels.end());
  }

  EventColumns columns_;
  std::vector<std::shared_ptr<Array>> arrays_;
  std::vector<std::int64_t> t_, x_, y_, p_, numbers_;
  std::vector<float> parts_;
  std::vector<EventLabel> labels_;  // of the events that were read, until read_labels()
  std::uint64_t count_ = 0, done_ = 0;
  std::size_t portion_ = 1 << 15;
};

}  // namespace

void take_column(std::string_view name, EventColumns::Column column, EventColumns& columns) {
  std::string key(name);
  for (char& c : key) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  const auto is_one_of = [&](std::initializer_list<std::string_view> names) {
    return std::find(names.begin(), names.end(), key) != names.end();
  };
  if (is_one_of({"t", "ts", "time", "timestamp", "timestamps"})) {
    columns.t = std::move(column);
  } else if (is_one_of({"x"})) {
    columns.x = std::move(column);
  } else if (is_one_of({"y"})) {
    columns.y = std::move(column);
  } else if (is_one_of({"p", "pol", "polarity", "polarities"})) {
    columns.p = std::move(column);
  } else if (std::ranges::find(kLabelNames, key) != kLabelNames.end()) {
    columns.labels.insert_or_assign(key, std::move(column));
  }
}

std::unique_ptr<EventsReader> make_columns_reader(const std::string& file, EventColumns columns) {
  for (const auto& [name, column] : {std::pair{"t", columns.t}, {"x", columns.x}, {"y", columns.y}, {"p", columns.p}}) {
    if (!column.array || column.field.kind == 'V') {
      throw UserError(
          fmt::format("cannot read {}: it has no numbers \"{}\": events need t, x, y and p as fields of one "
                      "array or as arrays of these names",
                      file, name));
    }
  }
  const auto is_unsupported = [](const auto& named) { return named.second.field.kind == 'V'; };
  if (std::ranges::any_of(columns.labels, is_unsupported)) columns.labels.clear();
  return std::make_unique<ColumnsReader>(std::move(columns));
}

}  // namespace esim::inline formats::numpy
