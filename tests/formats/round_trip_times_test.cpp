// Times of a recording that is converted from DSEC's layout to another format and back.
#include <gtest/gtest.h>

#include "esim/formats/copy_recording.h"
#include "esim/formats/formats.h"
#include "esim/formats/hdf5/dsec.h"
#include "formats/event_formats.h"
#include "formats/recordings.h"
#include "support/temporary_directory.h"

namespace esim {
namespace {

namespace fs = std::filesystem;

class RoundTripTimes : public testing::TestWithParam<std::string> {
 protected:
  fs::path convert(const fs::path& from, const Format& format, const std::string& name) const {
    const fs::path to = base_.path() / (name + format.extension());
    convert_recording(from, format, to, {}, [](double) { return true; });
    return to;
  }

  test::TemporaryDirectory base_;
  const Format& format_ = format_named(GetParam());
  const Format& dsec_ = format_named("dsec");
};

std::vector<Event> events_between(TimeNs first, TimeNs last) {
  std::vector<Event> events = test::random_events(20'000, 128, 96, first, last);
  events.front().t = first, events.back().t = last;
  for (Event& event : events) event.t -= event.t % kNsPerUs;
  return events;
}

// The first event is 310 us after the start, and the last 0.8 ms before the end.
TEST_P(RoundTripTimes, OfARecordingFromZeroStayAsTheyAre) {
  const auto events = events_between(310 * kNsPerUs, kNsPerSecond - 800 * kNsPerUs);
  const fs::path first = base_.path() / "first.h5";
  test::record(*dsec_.create(first, {}), test::recording_info(128, 96, 0, kNsPerSecond), events);
  const EventsHdf5Reader back(convert(convert(first, format_, "between"), dsec_, "back"));
  EXPECT_EQ(back.t_offset(), 0);
  EXPECT_EQ(back.read(0, events.size() + 1), events);
  const auto index = EventsHdf5Reader(first).ms_to_idx(), found = back.ms_to_idx();
  ASSERT_EQ(index.size(), 1001U);
  ASSERT_GE(found.size(), 1001U) << "up to just after the last event";
  EXPECT_TRUE(std::equal(index.begin(), index.end(), found.begin()));
}

TEST_P(RoundTripTimes, OfALaterRecordingStayAsTheyAre) {
  const TimeNs start = 3'250'007 * kNsPerUs;
  const auto events = events_between(start + 310 * kNsPerUs, start + kNsPerSecond);
  const fs::path first = base_.path() / "first.h5";
  test::record(*dsec_.create(first, {}), test::recording_info(128, 96, start, start + kNsPerSecond), events);
  const EventsHdf5Reader back(convert(convert(first, format_, "between"), dsec_, "back"));
  EXPECT_LE(back.t_offset(), events.front().t);
  EXPECT_EQ(back.read(0, events.size() + 1), events);
  EXPECT_EQ(back.read_window(start, start + 500 * kNsPerMs),
            EventsHdf5Reader(first).read_window(start, start + 500 * kNsPerMs));
}

// For a file without a start.
TEST_P(RoundTripTimes, OfATextStayAsTheyAre) {
  const auto events = events_between(310 * kNsPerUs, kNsPerSecond - 800 * kNsPerUs);
  const fs::path text = base_.path() / "events.txt";
  test::record(*format_named("text").create(text, {}), test::recording_info(128, 96, 0, kNsPerSecond), events);
  ConvertOptions options;
  options.read.sensor = SensorSize{128, 96};
  const fs::path between = base_.path() / ("between" + format_.extension());
  convert_recording(text, format_, between, options, [](double) { return true; });
  const EventsHdf5Reader back(convert(between, dsec_, "back"));
  EXPECT_EQ(back.read(0, events.size() + 1), events);
  EXPECT_EQ(back.t_offset(), 0) << "the whole second before";
}

INSTANTIATE_TEST_SUITE_P(Formats, RoundTripTimes, testing::ValuesIn(test::event_formats(true)), test::name_of_test);

using DsecToDsec = RoundTripTimes;

TEST_P(DsecToDsec, GivesTheSameBytes) {
  for (const TimeNs start : {TimeNs{0}, 49'599'300'523 * kNsPerUs, -2'000'000'500 * kNsPerUs}) {
    for (const TimeNs duration : {kNsPerSecond, TimeNs{123'456'000}}) {
      for (const bool any : {true, false}) {
        const auto events =
            any ? events_between(start + 310 * kNsPerUs, start + duration - 800 * kNsPerUs) : std::vector<Event>{};
        const fs::path first = base_.path() / "first.h5";
        test::record(*dsec_.create(first, {}), test::recording_info(128, 96, start, start + duration), events);
        const fs::path again = convert(first, dsec_, "again" + std::to_string(start) + std::to_string(duration + any));
        EXPECT_TRUE(test::content(first) == test::content(again)) << start << " " << duration << " " << any;
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Formats, DsecToDsec, testing::Values("dsec"), test::name_of_test);

}  // namespace
}  // namespace esim
