// Labels of events in every format that holds them: round trips, conversions, damaged and unfinished files.
#include <gtest/gtest.h>
#include <hdf5.h>

#include <random>

#include "esim/core/error.h"
#include "esim/formats/copy_recording.h"
#include "esim/formats/filter_recording.h"
#include "esim/formats/formats.h"
#include "esim/formats/hdf5/dsec.h"
#include "formats/event_formats.h"
#include "formats/recordings.h"
#include "support/errors.h"
#include "support/temporary_directory.h"

namespace esim {
namespace {

namespace fs = std::filesystem;
using test::contains;
using test::message_of;

constexpr int kWidth = 64, kHeight = 48;
constexpr TimeNs kStart = 3 * kNsPerSecond, kEnd = 7 * kNsPerSecond;

struct Labelled {
  std::vector<Event> events;
  std::vector<EventLabel> labels;
  bool has_labels = true;
};

RecordingInfo info_with_labels(bool has_labels = true) {
  RecordingInfo info = test::recording_info(kWidth, kHeight, kStart, kEnd);
  info.cameras[0].has_labels = has_labels;
  return info;
}

/// Events with labels that are all different; some ideal times are before the recording's start.
Labelled random_labels(std::size_t count) {
  Labelled all{test::random_events(count, kWidth, kHeight, kStart, kEnd), {}};
  std::mt19937 random(5);
  const auto part = [&] { return std::uniform_real_distribution<float>(-1, 1)(random); };
  for (const Event& event : all.events) {
    EventLabel label;
    label.t_ideal = event.t - static_cast<TimeNs>(random() % 5'000'000);
    label.signal = part(), label.flicker = part(), label.noise = part(), label.leak = part();
    label.object = static_cast<std::uint16_t>(random()), label.semantic_class = static_cast<std::uint16_t>(random());
    label.cause = static_cast<EventCause>(random() % 4);
    label.hot = random() % 2;
    all.labels.push_back(label);
  }
  return all;
}

void write(Sink& sink, const Labelled& all, bool complete = true) {
  sink.begin(info_with_labels());
  std::mt19937 random(2);
  const EventsRecord whole{0, all.events, all.labels};
  for (std::size_t done = 0; done < all.events.size();) {
    const std::size_t count = std::min<std::size_t>(random() % 5000, all.events.size() - done);
    sink.write(whole.part(done, count));
    done += count;
  }
  sink.end(complete);
}

Labelled read(const fs::path& path, const ReadOptions& options = {}) {
  const auto source = open_source(path, options);
  Labelled all;
  all.has_labels = source->info().cameras.at(0).has_labels;
  while (const Record* record = source->next()) {
    const auto* const part = std::get_if<EventsRecord>(record);
    if (part == nullptr) continue;
    EXPECT_EQ(part->labels.size(), all.has_labels ? part->events.size() : 0);
    all.events.insert(all.events.end(), part->events.begin(), part->events.end());
    all.labels.insert(all.labels.end(), part->labels.begin(), part->labels.end());
  }
  return all;
}

/// Rounds all times down to microseconds.
Labelled in_microseconds(Labelled all) {
  for (Event& event : all.events) event.t -= event.t % kNsPerUs;
  for (EventLabel& label : all.labels) label.t_ideal -= label.t_ideal % kNsPerUs;
  return all;
}

void expect_same(const Labelled& found, const Labelled& expected) {
  EXPECT_TRUE(found.has_labels);
  EXPECT_EQ(found.events, expected.events);
  EXPECT_EQ(found.labels, expected.labels);
}

/// The first labels of `expected`.
void expect_beginning(const Labelled& found, const Labelled& expected) {
  ASSERT_EQ(found.events.size(), found.labels.size());
  ASSERT_LE(found.events.size(), expected.events.size());
  EXPECT_TRUE(std::equal(found.events.begin(), found.events.end(), expected.events.begin()));
  EXPECT_TRUE(std::equal(found.labels.begin(), found.labels.end(), expected.labels.begin()));
}

std::vector<std::string> formats_with_labels() {
  std::vector<std::string> names;
  for (const std::string& name : test::event_formats(true)) {
    if (format_named(name).can_hold(Content::event_labels)) names.push_back(name);
  }
  return names;
}

class EventLabels : public testing::TestWithParam<std::string> {
 protected:
  fs::path path(const std::string& name) const { return base_.path() / (name + format_.extension()); }

  const Format& format_ = format_named(GetParam());
  test::TemporaryDirectory base_;
};

TEST_P(EventLabels, AreReadAsTheyWereWritten) {
  const Labelled all = random_labels(150'000);
  for (const Compression compression : {Compression::none, Compression::gzip}) {
    for (const TimeUnit unit : {TimeUnit::us, TimeUnit::ns}) {
      const fs::path file = path("a" + std::to_string(static_cast<int>(compression) * 2 + static_cast<int>(unit)));
      write(*format_.create(file, {.unit = unit, .compression = compression}), all);
      expect_same(read(file), unit == TimeUnit::ns ? all : in_microseconds(all));
    }
  }
}

TEST_P(EventLabels, AreThereWithoutEvents) {
  write(*format_.create(path("empty"), {}), {});
  const Labelled found = read(path("empty"));
  EXPECT_EQ(found.has_labels, GetParam() != "recording") << "a folder then has no file for them";
  EXPECT_TRUE(found.events.empty());
}

TEST_P(EventLabels, AreNotThereUnlessTheyWereWritten) {
  Labelled all = random_labels(1000);
  test::record(*format_.create(path("plain"), {.unit = TimeUnit::ns}), info_with_labels(false), all.events);
  const Labelled found = read(path("plain"));
  EXPECT_FALSE(found.has_labels);
  EXPECT_EQ(found.events, all.events);
}

TEST_P(EventLabels, AreCopiedOrNamedAsLeftOut) {
  const Labelled all = random_labels(20'000);
  write(*format_.create(path("from"), {.unit = TimeUnit::ns}), all);
  const auto go_on = [](double) { return true; };
  for (const std::string& name : test::event_formats(true)) {
    const Format& to = format_named(name);
    if (to.max_width < kWidth || to.max_height < kHeight) continue;
    const fs::path out = base_.path() / ("to-" + name + to.extension());
    ConvertOptions options;
    options.copy.write.unit = TimeUnit::ns;
    const CopySummary summary = convert_recording(path("from"), to, out, options, go_on);
    const bool holds = to.can_hold(Content::event_labels);
    const auto& where = holds ? summary.copied : summary.left_out;
    ASSERT_TRUE(where.contains(Content::event_labels)) << name;
    EXPECT_EQ(where.at(Content::event_labels), all.events.size()) << name;
    if (holds) expect_same(read(out), all);
  }
}

TEST_P(EventLabels, FollowTheirEventsThroughFilters) {
  const Labelled all = random_labels(50'000);
  write(*format_.create(path("from"), {.unit = TimeUnit::ns}), all);
  FilterOptions filters;
  filters.region = RegionFilterOptions{false, {{3, 2, 40, 30}}, {{20, 9}}};
  filters.trail = TrailFilterOptions{TrailType::stc_keep_trail, 50'000};
  ConvertOptions options;
  options.copy.write.unit = TimeUnit::ns;
  filter_recording(path("from"), format_, path("to"), filters, options, [](double) { return true; });
  const Labelled found = read(path("to"));
  EXPECT_TRUE(found.has_labels);
  EXPECT_GT(found.events.size(), 100U);
  EXPECT_LT(found.events.size(), all.events.size());
  std::size_t at = 0;
  for (std::size_t i = 0; i < found.events.size(); ++i) {
    while (at < all.events.size() && all.events[at] != found.events[i]) ++at;
    ASSERT_LT(at, all.events.size());
    ASSERT_EQ(found.labels[i], all.labels[at]) << i;
    ++at;
  }
}

INSTANTIATE_TEST_SUITE_P(Formats, EventLabels, testing::ValuesIn(formats_with_labels()), test::name_of_test);

TEST(FormatsWithLabels, AreThese) {
  EXPECT_EQ(formats_with_labels(), (std::vector<std::string>{"npz", "dsec", "recording"}));
}

class LabelsInHdf5 : public testing::Test {
 protected:
  void SetUp() override {
    EventsHdf5Writer writer(file_, 0, {TimeUnit::ns, Compression::none});
    write(writer, all_);
  }

  /// Applies `change` to the open file.
  template <typename Change>
  void edit(const Change& change) {
    const hid_t file = H5Fopen(file_.c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
    change(file);
    H5Fclose(file);
  }
  void set(const char* column, hsize_t item, std::uint8_t value) {
    edit([&](hid_t file) {
      const hid_t data = H5Dopen2(file, (std::string("events/labels/") + column).c_str(), H5P_DEFAULT);
      const hid_t space = H5Dget_space(data), one = H5Screate(H5S_SCALAR);
      H5Sselect_elements(space, H5S_SELECT_SET, 1, &item);
      H5Dwrite(data, H5T_NATIVE_UINT8, one, space, H5P_DEFAULT, &value);
      H5Sclose(one), H5Sclose(space), H5Dclose(data);
    });
  }
  std::string problem() {
    return message_of<UserError>([&] { read(file_); });
  }

  const Labelled all_ = random_labels(70'000);
  test::TemporaryDirectory base_;
  fs::path file_ = base_.path() / "events.h5";
};

TEST_F(LabelsInHdf5, StateTheirCauses) {
  edit([&](hid_t file) { EXPECT_GT(H5Aexists_by_name(file, "events/labels/cause", "names", H5P_DEFAULT), 0); });
  expect_same(read(file_), all_);
}

TEST_F(LabelsInHdf5, WithInvalidNumbersAreReadUpToThese) {
  set("cause", 66'000, 4);
  EXPECT_TRUE(contains(problem(), "events/labels/cause has the value 4, but must be from 0 to 3")) << problem();
  EXPECT_TRUE(contains(problem(), file_.string()));
  std::string told;
  const Labelled found = read(file_, {.recover = [&](const std::string& what) { told = what; }});
  EXPECT_GT(found.events.size(), 60'000U);
  expect_beginning(found, all_);
  EXPECT_TRUE(contains(told, "events/labels/cause"));
}

TEST_F(LabelsInHdf5, AreHotOrNot) {
  set("hot", 5, 7);
  EXPECT_TRUE(contains(problem(), "events/labels/hot has the value 7, but must be from 0 to 1")) << problem();
}

TEST_F(LabelsInHdf5, MustHaveAllColumns) {
  edit([](hid_t file) { H5Ldelete(file, "events/labels/leak", H5P_DEFAULT); });
  EXPECT_TRUE(contains(problem(), "events/labels/leak")) << problem();
}

TEST_F(LabelsInHdf5, MustBeAsManyAsEvents) {
  edit([](hid_t file) {
    const hid_t data = H5Dopen2(file, "events/labels/noise", H5P_DEFAULT);
    const hsize_t fewer = 69'999;
    H5Dset_extent(data, &fewer);
    H5Dclose(data);
  });
  EXPECT_TRUE(contains(problem(), "differ in length")) << problem();
  // In a file whose writer was killed, the common part is valid.
  edit([](hid_t file) {
    const hid_t flag = H5Aopen(file, "esim_complete", H5P_DEFAULT);
    const std::uint8_t no = 0;
    H5Awrite(flag, H5T_NATIVE_UINT8, &no);
    H5Aclose(flag);
  });
  const Labelled found = read(file_, {.recover = [](const std::string&) {}});
  EXPECT_EQ(found.events.size(), 69'999U);
  expect_beginning(found, all_);
}

TEST_F(LabelsInHdf5, MustComeWithTheirEvents) {
  EventsHdf5Writer writer(base_.path() / "other.h5", 0, {TimeUnit::ns, Compression::none});
  writer.begin(info_with_labels());
  EXPECT_THROW(writer.write(EventsRecord{0, all_.events, LabelSpan(all_.labels).first(5)}), InternalError);
}

TEST(UnfinishedLabels, OfAKilledRecordingAreReadWithTheirEvents) {
  const Labelled all = random_labels(200'000);
  const test::TemporaryDirectory base;
  const fs::path folder = base.path() / "out.incomplete";
  RecordingInfo info = info_with_labels();
  const auto sink = format_named("recording").create(folder, {.unit = TimeUnit::ns});
  sink->begin(info);
  sink->write(EventsRecord{0, all.events, all.labels});
  base.write("out.incomplete/report.json", "{\"status\": \"running\"}\n");
  // What a killed process leaves: the last chunk is not written.
  const fs::path killed = base.path() / "killed.incomplete";
  fs::copy(folder, killed, fs::copy_options::recursive);
  const Labelled found = read(killed);
  EXPECT_TRUE(found.has_labels);
  EXPECT_GT(found.events.size(), 100'000U);
  expect_beginning(found, all);
  sink->end(false);
  expect_same(read(folder), all);
}

}  // namespace
}  // namespace esim
