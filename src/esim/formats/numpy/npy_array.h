#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "esim/core/time.h"
#include "esim/files/npy_header.h"
#include "esim/formats/events_reader.h"

/// Arrays of numbers or of records of numbers, with at most one dimension.
namespace esim::inline formats::numpy {

/// The NumPy type of times: a plain number of us, which is the usual interpretation, or timedelta64[ns].
std::string_view time_type(TimeUnit unit);

/// Rounded down.
constexpr std::int64_t microseconds(TimeNs t) { return t / kNsPerUs - (t % kNsPerUs < 0 ? 1 : 0); }

/// One number in each item of an array.
struct Field {
  std::string name{};
  char kind = 0;           ///< NumPy's kind: i, u, f, b, m or M; V: unsupported
  std::size_t bytes = 0;   ///< of it
  std::size_t offset = 0;  ///< in the item
  bool big_endian = false;
  TimeNs unit = 0;  ///< unit of the kinds m and M, ns
};

/// An array that is read item by item.
class Array {
 public:
  /// Throws UserError if it is not a valid array. `name` is the name of the file in messages.
  Array(std::string name, Read read);

  const std::vector<Field>& fields() const { return fields_; }  ///< a single nameless one if items are not records
  std::uint64_t count() const { return count_; }
  bool one_dimension() const { return one_dimension_; }  ///< or with one item only
  std::size_t item_bytes() const { return item_bytes_; }

  /// Replaces the items in memory by the next ones; returns their number.
  std::size_t advance(std::size_t count);

  static constexpr std::int64_t kNoNumber = std::numeric_limits<std::int64_t>::min();

  /// A field of all items in memory: integers, or kNoNumber for other values.
  void integers(const Field& field, std::vector<std::int64_t>& out) const;

  /// The same as floating-point numbers.
  void floats(const Field& field, std::vector<float>& out) const;

  /// The same as times in ns: integers are in us, floating-point numbers in s.
  void times(const Field& field, std::vector<std::int64_t>& out) const;

  [[noreturn]] void fail(const std::string& what) const;

 private:
  void take_fields(const npy::Literal& descr);

  std::string name_;
  Read read_;
  std::vector<Field> fields_;
  std::uint64_t count_ = 0;
  bool one_dimension_ = false;
  std::size_t item_bytes_ = 0;
  std::vector<std::byte> items_;
  std::size_t held_ = 0;
};

/// The columns of events, each a field of an array.
struct EventColumns {
  struct Column {
    std::shared_ptr<Array> array{};
    Field field{};
  };
  Column t{}, x{}, y{}, p{};
  std::map<std::string, Column> labels{};  ///< columns of labels by name; unless all exist, none is read
  SensorSize sensor{};
};

/// Sets the column for this name: t, ts, time, timestamp(s); x; y; p, pol, polarity, polarities; or one of the labels.
/// Ignores other names.
void take_column(std::string_view name, EventColumns::Column column, EventColumns& columns);

/// Throws UserError that names the file if a column is missing.
std::unique_ptr<EventsReader> make_columns_reader(const std::string& file, EventColumns columns);

}  // namespace esim::inline formats::numpy
