#include "esim/formats/text/events_text.h"

#include <charconv>
#include <utility>

#include "esim/files/number_text.h"
#include "esim/formats/events_reader.h"

namespace esim::inline formats {
namespace {

template <typename Integer>
char* put(char* out, Integer value) {
  return std::to_chars(out, out + 24, value).ptr;
}

class LinesReader final : public EventsReader {
 public:
  explicit LinesReader(const std::filesystem::path& path) : reader_(path) {}

  bool read(std::vector<Event>& events) override { return reader_.read(events, kPortion); }
  double progress() const override { return reader_.progress(); }

 private:
  static constexpr std::size_t kPortion = 1 << 16;
  EventsTextReader reader_;
};

bool is_printable(std::string_view text) { return text.find('\0') == std::string_view::npos; }

}  // namespace

Format events_text_format() {
  return {
      .name = "text",
      .description = "lines `t x y p`: s, px, px, 1 or 0",
      .extensions = {".txt", ".csv"},
      .holds = {Content::events},
      .recognises = [](const auto&, std::string_view head) { return is_printable(head); },
      .open =
          [](const auto& path, const ReadOptions& options) {
            return make_events_source(std::make_unique<LinesReader>(path), options);
          },
      .create = [](const auto& path, const WriteOptions&) { return std::make_unique<EventsTextWriter>(path, 0); },
  };
}

void EventsTextWriter::begin(const RecordingInfo&) { file_.emplace(path_); }

void EventsTextWriter::write(const Record& record) {
  const auto* events = std::get_if<EventsRecord>(&record);
  if (events == nullptr || events->camera != camera_) return;
  char line[96];
  for (const Event& event : events->events) {
    char* out = put_seconds(line, event.t);
    *out++ = ' ';
    out = put(out, event.x);
    *out++ = ' ';
    out = put(out, event.y);
    *out++ = ' ';
    *out++ = event.polarity > 0 ? '1' : '0';
    *out++ = '\n';
    file_->buffer().append(line, out);
    file_->flush_if_full();
  }
}

void EventsTextWriter::end(bool) {
  if (file_) file_->close();
  file_.reset();
}

Event EventsTextReader::parse(std::string_view line) const {
  Event event;
  int polarity = 0;
  const std::string_view t = take_word(line), x = take_word(line), y = take_word(line), p = take_word(line);
  if (p.empty() || !take_word(line).empty()) lines_.fail("expected four numbers: t x y p");
  if (!parse_seconds(t, event.t)) lines_.fail("\"" + std::string(t) + "\" is not a time in seconds");
  if (!parse_number(x, event.x)) lines_.fail("\"" + std::string(x) + "\" is not a column");
  if (!parse_number(y, event.y)) lines_.fail("\"" + std::string(y) + "\" is not a row");
  if (!parse_number(p, polarity) || polarity < -1 || polarity > 1) {
    lines_.fail("\"" + std::string(p) + "\" is not a polarity: 1 (ON) or 0 (OFF)");
  }
  event.polarity = polarity > 0 ? 1 : -1;
  return event;
}

bool EventsTextReader::read(std::vector<Event>& events, std::size_t count) {
  events.clear();
  std::string_view line;
  while (events.size() < count && lines_.next(line)) {
    std::string_view rest = line;
    const std::string_view first = take_word(rest);
    if (first.empty() || first[0] == '#') continue;
    const Event event = parse(line);
    if (last_t_ && event.t < *last_t_) {
      std::string above;
      append_seconds(above, *last_t_);
      lines_.fail("the time is before that of the line above, " + above + " s: sort the events by time");
    }
    last_t_ = event.t;
    events.push_back(event);
  }
  return !events.empty();
}

}  // namespace esim::inline formats
