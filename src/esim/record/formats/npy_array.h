#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "esim/core/npy_header.h"
#include "esim/core/time.h"
#include "esim/record/events_reader.h"

/// Arrays of numbers and of records of numbers, with one dimension or none.
namespace esim::npy {

/// The time as NumPy types it: a plain number of us, which is what others take it for, or a timedelta64[ns].
std::string_view time_type(TimeUnit unit);

/// Rounded down.
constexpr std::int64_t microseconds(TimeNs t) { return t / kNsPerUs - (t % kNsPerUs < 0 ? 1 : 0); }

/// One number of each item of an array.
struct Field {
  std::string name{};
  char kind = 0;           ///< NumPy's: i, u, f, b, m or M; V for those that cannot be read
  std::size_t bytes = 0;   ///< of it
  std::size_t offset = 0;  ///< in the item
  bool big_endian = false;
  TimeNs unit = 0;  ///< of kinds m and M
};

/// An array as it is read, item by item.
class Array {
 public:
  /// Throws UserError where it is no array. `name` is that of the file, for people.
  Array(std::string name, Read read);

  const std::vector<Field>& fields() const { return fields_; }  ///< one without a name, where items are no records
  std::uint64_t count() const { return count_; }
  bool one_dimension() const { return one_dimension_; }  ///< or others of one item only
  std::size_t item_bytes() const { return item_bytes_; }

  /// Replaces what is held by the next items; how many of them there are.
  std::size_t advance(std::size_t count);

  static constexpr std::int64_t kNoNumber = std::numeric_limits<std::int64_t>::min();

  /// A field of all items held: integers, or kNoNumber where it is something else.
  void integers(const Field& field, std::vector<std::int64_t>& out) const;

  /// The same as times in ns: integers are us, floating-point numbers s.
  void times(const Field& field, std::vector<std::int64_t>& out) const;

  [[noreturn]] void fail(const std::string& what) const;

 private:
  void take_fields(const Literal& descr);

  std::string name_;
  Read read_;
  std::vector<Field> fields_;
  std::uint64_t count_ = 0;
  bool one_dimension_ = false;
  std::size_t item_bytes_ = 0;
  std::vector<std::byte> items_;
  std::size_t held_ = 0;
};

/// What events are made of, wherever the numbers stand: each is a field of one array.
struct EventColumns {
  struct Column {
    std::shared_ptr<Array> array{};
    Field field{};
  };
  Column t{}, x{}, y{}, p{};
  SensorSize sensor{};
};

/// Puts the column where its name says: t, ts, time, timestamp(s); x; y; p, pol, polarity, polarities. Others, too.
void take_column(std::string_view name, EventColumns::Column column, EventColumns& columns);

/// Fails, in the name of the file, where a column is missing.
std::unique_ptr<EventsReader> make_columns_reader(const std::string& file, EventColumns columns);

}  // namespace esim::npy
