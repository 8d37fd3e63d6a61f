#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "esim/events/event_label.h"
#include "esim/formats/hdf5/input.h"
#include "esim/formats/hdf5/library.h"
#include "esim/formats/label_columns.h"

// Private to formats/hdf5.
namespace esim::inline formats::hdf5 {

inline constexpr const char* kLabels = "events/labels";
inline std::string label_name(const char* column) { return std::string(kLabels) + "/" + column; }

/// The datasets of labels in a file that is being written. Waiting labels are written together with their events.
class LabelSeries {
 public:
  LabelSeries(const Output& file, hsize_t chunk, Compression compression) {
    file.create_group(kLabels);
    const auto series = [&](const char* name, hid_t type) {
      return series_.emplace_back(file, label_name(name).c_str(), SeriesLayout{type, {}, chunk, compression}).id();
    };
    series("t_ideal", H5T_STD_I64LE);
    for (const auto& part : kLabelParts) series(part.name, H5T_IEEE_F32LE);
    for (const auto& surface : kLabelSurfaces) series(surface.name, H5T_STD_U16LE);
    const hid_t cause = series("cause", H5T_STD_U8LE);
    const auto& names = kEnumNames<EventCause>;
    file.create_text_attribute(cause, "names", std::vector<std::string>(names.begin(), names.end()));
    series("hot", H5T_STD_U8LE);
  }

  void store(const EventLabel& label) { waiting_.push_back(label); }

  /// Writes the waiting labels; `units` converts times.
  template <typename Units>
  void write(const Units& units) {
    auto series = series_.begin();
    const auto append = [&]<typename Number>(const auto& number, Number) {
      std::vector<Number> numbers;
      numbers.reserve(waiting_.size());
      for (const EventLabel& label : waiting_) numbers.push_back(static_cast<Number>(number(label)));
      (series++)->append(std::span<const Number>(numbers));
    };
    append([&](const EventLabel& label) { return units(label.t_ideal); }, std::int64_t{});
    for (const auto& part : kLabelParts) append([&](const EventLabel& label) { return label.*part.member; }, float{});
    for (const auto& surface : kLabelSurfaces)
      append([&](const EventLabel& label) { return label.*surface.member; }, std::uint16_t{});
    append([](const EventLabel& label) { return label.cause; }, std::uint8_t{});
    append([](const EventLabel& label) { return label.hot; }, std::uint8_t{});
    waiting_.clear();
  }

 private:
  std::vector<Series> series_;
  std::vector<EventLabel> waiting_;
};

/// The datasets of labels in a file.
class LabelColumns {
 public:
  explicit LabelColumns(const Input& file) {
    t_ideal_ = file.open_column(label_name("t_ideal").c_str());
    for (const auto& part : kLabelParts) parts_.push_back(file.open_items(label_name(part.name).c_str(), 0));
    for (const auto& surface : kLabelSurfaces) surfaces_.push_back(file.open_column(label_name(surface.name).c_str()));
    cause_ = file.open_column(label_name("cause").c_str());
    hot_ = file.open_column(label_name("hot").c_str());
  }

  /// The number of complete labels, and whether all columns have this length.
  std::pair<hsize_t, bool> size() const {
    hsize_t shortest = t_ideal_.size, longest = shortest;
    const auto look_at = [&](const Column& column) {
      shortest = std::min(shortest, column.size), longest = std::max(longest, column.size);
    };
    for (const Column& column : parts_) look_at(column);
    for (const Column& column : surfaces_) look_at(column);
    look_at(cause_), look_at(hot_);
    return {shortest, shortest == longest};
  }

  /// Appends labels; `to_ns` converts times.
  template <typename ToNs>
  void read(const Input& file, hsize_t first, hsize_t count, const ToNs& to_ns, std::vector<EventLabel>& labels) const {
    std::vector<EventLabel> block(count);
    const auto each = [&]<typename Number>(const Column& column, Number, const auto& set) {
      std::vector<Number> numbers(count);
      file.read(column, first, std::span(numbers));
      for (std::size_t i = 0; i < count; ++i) set(block[i], numbers[i]);
    };
    each(t_ideal_, std::int64_t{}, [&](EventLabel& label, std::int64_t t) { label.t_ideal = to_ns(t); });
    for (std::size_t k = 0; k < parts_.size(); ++k)
      each(parts_[k], float{}, [&](EventLabel& label, float part) { label.*kLabelParts[k].member = part; });
    for (std::size_t k = 0; k < surfaces_.size(); ++k) {
      each(surfaces_[k], std::uint16_t{},
           [&](EventLabel& label, std::uint16_t number) { label.*kLabelSurfaces[k].member = number; });
    }
    const auto below = [&](const char* name, std::uint8_t number, std::size_t end) {
      if (number >= end)
        file.fail(label_name(name) + " has the value " + std::to_string(number) + ", but must be from 0 to " +
                  std::to_string(end - 1));
      return number;
    };
    each(cause_, std::uint8_t{}, [&](EventLabel& label, std::uint8_t cause) {
      label.cause = static_cast<EventCause>(below("cause", cause, kEnumNames<EventCause>.size()));
    });
    each(hot_, std::uint8_t{}, [&](EventLabel& label, std::uint8_t hot) { label.hot = below("hot", hot, 2); });
    labels.insert(labels.end(), block.begin(), block.end());
  }

 private:
  Column t_ideal_, cause_, hot_;
  std::vector<Column> parts_, surfaces_;
};

}  // namespace esim::inline formats::hdf5
