#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "esim/events/event.h"
#include "esim/files/line_reader.h"
#include "esim/files/output_file.h"
#include "esim/recording/format.h"
#include "esim/recording/record.h"

namespace esim::inline formats {

/// Events of one camera as lines `t x y p`, as in the Event Camera Dataset: seconds with nine decimals, px, px, and 1
/// (ON) or 0 (OFF).
class EventsTextWriter final : public Sink {
 public:
  EventsTextWriter(std::filesystem::path path, int camera) : path_(std::move(path)), camera_(camera) {}

  void begin(const RecordingInfo& info) override;
  void write(const Record& record) override;
  void end(bool complete) override;

 private:
  std::filesystem::path path_;
  int camera_;
  std::optional<OutputFile> file_;
};

Format events_text_format();

/// Reads such lines, with any number of decimals, but no exponents. Empty lines and lines that start with # are
/// skipped. Digits beyond the nanosecond are dropped. Throws UserError, with file and line, for anything else and for
/// times that decrease.
class EventsTextReader {
 public:
  explicit EventsTextReader(std::filesystem::path path) : lines_(std::move(path)) {}
  explicit EventsTextReader(LineReader lines) : lines_(std::move(lines)) {}

  /// Replaces `events` by the next ones, at most `count`; returns false at the end. If it throws, they are the events
  /// before the invalid line.
  bool read(std::vector<Event>& events, std::size_t count);

  /// The fraction of the file that has been read.
  double progress() const { return lines_.progress(); }

 private:
  Event parse(std::string_view line) const;

  LineReader lines_;
  std::optional<TimeNs> last_t_;
};

}  // namespace esim::inline formats
