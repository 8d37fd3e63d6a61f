// Recordings of simulations that were killed, or found the disk full, and everything that reads them.
#include <gtest/gtest.h>

#include <map>

#include "esim/core/error.h"
#include "esim/files/output_file.h"
#include "esim/formats/copy_recording.h"
#include "esim/formats/events_file.h"
#include "esim/formats/formats.h"
#include "esim/formats/hdf5/dsec.h"
#include "esim/formats/inspect.h"
#include "esim/formats/text/imu_csv.h"
#include "esim/recording/fan_out.h"
#include "formats/recordings.h"
#include "support/errors.h"
#include "support/temporary_directory.h"

namespace esim {
namespace {

namespace fs = std::filesystem;
using test::contains;
using test::message_of;

constexpr const char* kRunning = "{\"status\": \"running\"}\n";
constexpr int kWidth = 24, kHeight = 16, kSteps = 40;
constexpr TimeNs kStep = 10 * kNsPerMs;

ImuRecord imu_at(int i) {
  return {i * kStep, {{0.1 * i, 1.0 / 3, 2}, {0, 0, 9.81}}, {{1e-5, 2e-5, 3e-5 * i}, {0, 0, 0}}};
}

PoseRecord pose_at(int i) {
  PoseRecord pose{i * kStep, {}};
  pose.objects.emplace_back();
  return pose;
}

class UnfinishedRecording : public testing::Test {
 protected:
  /// A recording with a file of each kind, as if its writer had been killed at the end.
  void write_all() {
    RecordingInfo info = test::recording_info(kWidth, kHeight, 0, kSteps * kStep, 100);
    info.cameras[0].model = Camera::from_fov(kWidth, kHeight, 1);
    info.imu = ImuInfo{{}, 100, 1e-3, 2e-5, 1e-2, 3e-4};
    info.objects = {"car"};
    const auto sink = format_named("recording").create(folder_, {});
    sink->begin(info);
    events_ = test::random_events(200'000, kWidth, kHeight, 0, kSteps * kStep - kNsPerMs);
    for (Event& event : events_) event.t -= event.t % kNsPerUs;
    sink->write(EventsRecord{0, events_});
    for (int i = 0; i < kSteps; ++i) {
      const test::TruthImages truth(kWidth, kHeight, 0.1 * i);
      const Image<std::uint16_t> frame(kWidth, kHeight, static_cast<std::uint16_t>(i));
      sink->write(imu_at(i));
      sink->write(pose_at(i));
      sink->write(FrameRecord{0, i * kStep, i * kStep, kNsPerMs, 1, frame, 8});
      sink->write(truth.at(i * kStep));
    }
    sink->end(false);
    base_.write("out.incomplete/report.json", kRunning);
  }

  /// All readers accept it or throw a one-line UserError that names the file, or its copy, if the format needs the size
  /// of the sensor.
  void expect_order() {
    const auto in_order = [&](const std::string& what, const auto& work) {
      try {
        work();
      } catch (const UserError& error) {
        const bool needs_size = contains(error.what(), "the size of the sensor must be known");
        EXPECT_TRUE(contains(error.what(), needs_size ? "/copy." : "out.incomplete")) << what;
        EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << what << ": " << error.what();
      } catch (const std::exception& error) {
        ADD_FAILURE() << what << ": " << error.what();
      }
    };
    in_order("inspect", [&] { describe(inspect(folder_)); });
    in_order("events file", [&] {
      EventsFile file(folder_);
      for (std::vector<Event> events; file.read(events, 1000);) continue;
    });
    for (const Format& format : all_formats()) {
      if (!format.create) continue;
      const fs::path out = base_.path() / ("copy" + format.extension());
      ConvertOptions options;
      options.replace = true;
      const auto convert = [&] { convert_recording(folder_, format, out, options, [](double) { return true; }); };
      in_order(format.name, convert);
      options.read.recover = [](const std::string&) {};
      in_order(format.name + ", recovering", convert);
      fs::remove_all(out);
    }
  }

  int count(Content content) {
    int found = 0;
    const auto source = open_source(folder_);
    while (const Record* record = source->next()) found += content_of(*record) == content ? 1 : 0;
    return found;
  }

  void cut(const std::string& name, std::size_t bytes_less) {
    const fs::path file = folder_ / name;
    fs::resize_file(file, fs::file_size(file) - bytes_less);
  }

  test::TemporaryDirectory base_;
  fs::path folder_ = base_.path() / "out.incomplete";
  std::vector<Event> events_;
};

TEST_F(UnfinishedRecording, ReportsEarlyStatesInOrder) {
  fs::create_directory(folder_);
  expect_order();
  base_.write("out.incomplete/report.json.tmp", "{\"sta");
  expect_order();
  base_.write("out.incomplete/report.json", "");
  expect_order();
  base_.write("out.incomplete/report.json", kRunning);
  const auto nothing = [&] { return message_of<UserError>([&] { open_source(folder_); }); };
  const auto no_events = [&] { return message_of<UserError>([&] { EventsFile file(folder_); }); };
  EXPECT_TRUE(contains(nothing(), "holds no records")) << "nothing but the report";
  expect_order();
  base_.write("out.incomplete/scenario.yaml", "duration_s: 1\n");
  fs::create_directories(folder_ / "calibration");
  base_.write("out.incomplete/calibration/rig.yaml.tmp", "label");
  fs::create_directory(folder_ / "cam0");
  EXPECT_TRUE(contains(nothing(), "holds no records")) << "the camera's folder is empty";
  expect_order();
  base_.write("out.incomplete/calibration/rig.yaml", "label: \"esim\"\ncameras:\n- camera:\n    la");
  expect_order();
  fs::remove(folder_ / "calibration" / "rig.yaml");
  for (const char* name : {"events.h5", "truth.h5", "frames.csv"})
    base_.write(std::string("out.incomplete/cam0/") + name, "");
  EXPECT_TRUE(contains(nothing(), "holds no records")) << "files that have just been created";
  EXPECT_TRUE(contains(no_events(), "holds no events")) << "an empty file is not a recording without events";
  expect_order();
  for (const char* name : {"events.h5", "truth.h5"})
    base_.write(std::string("out.incomplete/cam0/") + name, std::string(5000, '\0') + "later bytes come first");
  EXPECT_TRUE(contains(nothing(), "holds no records")) << "files that have no signature yet";
  EXPECT_TRUE(contains(no_events(), "holds no events"));
  expect_order();
  for (const char* name : {"events.h5", "truth.h5", "frames.csv"})
    base_.write(std::string("out.incomplete/cam0/") + name, "\x89HDF\r\n\x1a\n");
  expect_order();
}

TEST_F(UnfinishedRecording, IsBeingWrittenOrWasEnded) {
  fs::create_directory(folder_);
  base_.write("out.incomplete/report.json", kRunning);
  EXPECT_TRUE(contains(message_of<UserError>([&] { open_source(folder_); }), "create it again"));
  base_.write("out.incomplete/report.json", R"({"status": "complete"})");
  EXPECT_TRUE(contains(message_of<UserError>([&] { open_source(folder_); }), "holds no records"));
}

TEST_F(UnfinishedRecording, ReportsMissingAndTruncatedFilesInOrder) {
  const std::vector<std::string> files = {"report.json",
                                          "calibration/rig.yaml",
                                          "calibration/camchain.yaml",
                                          "states.csv",
                                          "imu.csv",
                                          "imu_truth.csv",
                                          "cam0/events.h5",
                                          "cam0/truth.h5",
                                          "cam0/frames.csv",
                                          "cam0/frames/000003.png"};
  for (const std::string& file : files) {
    for (const double kept : {-1.0, 0.0, 0.03, 0.5, 0.99}) {
      SCOPED_TRACE(file + ", of which is left " + std::to_string(kept));
      fs::remove_all(folder_);
      write_all();
      const auto bytes = static_cast<double>(fs::file_size(folder_ / file));
      kept < 0 ? static_cast<void>(fs::remove(folder_ / file))
               : fs::resize_file(folder_ / file, static_cast<std::uintmax_t>(kept * bytes));
      try {
        const auto source = open_source(folder_);
        while (source->next() != nullptr) continue;
        describe(inspect(folder_));
      } catch (const UserError& error) {
        EXPECT_TRUE(contains(error.what(), "out.incomplete"));
      }
    }
  }
}

TEST_F(UnfinishedRecording, LinesAreReadAsFarAsAllFilesReach) {
  write_all();
  EXPECT_EQ(count(Content::imu), kSteps);
  EXPECT_EQ(count(Content::poses), kSteps);
  cut("imu.csv", 3);  // a number that has lost its last digits is invalid
  EXPECT_EQ(count(Content::imu), kSteps - 1);
  cut("imu_truth.csv", 100);
  EXPECT_LT(count(Content::imu), kSteps - 1);
  cut("states.csv", 1);
  EXPECT_EQ(count(Content::poses), kSteps - 1);
  fs::resize_file(folder_ / "objects" / "car.csv", 0);
  EXPECT_EQ(count(Content::poses), 0);
  cut("cam0/frames.csv", 2);
  EXPECT_EQ(count(Content::frames), kSteps - 1);

  // In a recording that states to be complete, this is damage.
  base_.write("out.incomplete/report.json", R"({"status": "complete"})");
  EXPECT_THROW(count(Content::imu), UserError);
}

TEST(WithoutCameras, RecordingsGoIntoEveryFormatOrAreRefused) {
  const test::TemporaryDirectory base;
  const fs::path folder = base.path() / "imu";
  fs::create_directory(folder);
  base.write("imu/report.json", R"({"status": "complete"})");
  ImuCsvWriter writer(folder);
  writer.begin({});
  for (int i = 0; i < kSteps; ++i) writer.write(imu_at(i));
  writer.end(true);
  EXPECT_TRUE(contains(message_of<UserError>([&] { EventsFile file(folder); }), "imu"));
  for (const Format& format : all_formats()) {
    if (!format.create) continue;
    const fs::path out = base.path() / ("copy" + format.extension());
    const auto convert = [&] {
      return convert_recording(folder, format, out, {.replace = true}, [](double) { return true; });
    };
    if (format.several_cameras) {
      EXPECT_EQ(convert().complete, true) << format.name;
    } else {
      EXPECT_TRUE(contains(message_of<UserError>(convert), "no camera")) << format.name;
    }
    fs::remove_all(out);
  }
}

/// Fails at a record, as on a full disk, or only counts.
class Counting final : public Sink {
 public:
  explicit Counting(std::vector<std::string>& log, int fails_at = 0) : log_(log), fails_at_(fails_at) {}
  void begin(const RecordingInfo&) override {}
  void write(const Record&) override {
    if (++written_ == fails_at_) throw OutputError("the disk is full");
  }
  void end(bool complete) override {
    log_.push_back((complete ? "complete after " : "incomplete after ") + std::to_string(written_));
  }

 private:
  std::vector<std::string>& log_;
  int fails_at_, written_ = 0;
};

TEST(FanOut, EndsTheOthersWhereOneFails) {
  std::vector<std::string> log;
  FanOut sinks;
  sinks.add(std::make_unique<Counting>(log));
  sinks.add(std::make_unique<Counting>(log, 3));
  sinks.add(std::make_unique<Counting>(log));
  sinks.begin({});
  sinks.write(imu_at(0));
  sinks.write(imu_at(1));
  EXPECT_EQ(message_of<OutputError>([&] { sinks.write(imu_at(2)); }), "the disk is full");
  EXPECT_EQ(log, (std::vector<std::string>{"incomplete after 3", "incomplete after 2"}));
  sinks.end(true);
  EXPECT_EQ(log.size(), 2U) << "each once";
}

TEST(OutputFile, WritesNothingTwiceWhenThereIsRoomAgain) {
  const test::TemporaryDirectory base;
  OutputFile file(base.path() / "text");
  std::string text;
  for (int i = 0; i < 10'000; ++i) text += std::to_string(i) + "\n";
  file.append(text);
  {
    const test::FileSizeLimit full(1000);
    EXPECT_THROW(file.flush(), OutputError);
  }
  file.append("end\n");
  file.close();
  EXPECT_EQ(test::content(base.path() / "text"), text + "end\n");
}

TEST(OutputFile, AFullDiskLeavesNoTemporaryFile) {
  const test::TemporaryDirectory base;
  base.write("report.json", "old");
  {
    const test::FileSizeLimit full(1);
    EXPECT_THROW(write_file_atomically(base.path() / "report.json", "new and longer"), OutputError);
  }
  EXPECT_EQ(test::content(base.path() / "report.json"), "old");
  EXPECT_FALSE(fs::exists(base.path() / "report.json.tmp"));
}

/// Reads a file truncated by a full disk at each of many sizes: its records are the first ones written, in order.
TEST(FullDisk, LeavesTheBeginningOfTheEvents) {
  const test::TemporaryDirectory base;
  const std::vector<Event> events = test::random_events(600'000, 640, 480, 0, 10 * kNsPerSecond);
  for (const Compression compression : {Compression::none, Compression::gzip}) {
    const fs::path whole = base.path() / "whole.h5";
    {
      EventsHdf5Writer writer(whole, 0, {TimeUnit::ns, compression});
      test::record(writer, test::recording_info(640, 480, 0, 10 * kNsPerSecond), events);
    }
    const auto bytes = fs::file_size(whole);
    std::uint64_t max = 0;
    for (std::uintmax_t limit = 4096; limit < bytes; limit += bytes / 31) {
      const fs::path cut = base.path() / "cut.h5";
      {
        EventsHdf5Writer writer(cut, 0, {TimeUnit::ns, compression});
        writer.begin(test::recording_info(640, 480, 0, 10 * kNsPerSecond));
        const test::FileSizeLimit full(limit);
        const auto rest = [&] {
          test::write_in_batches(writer, events, 4096);
          writer.end(true);
        };
        EXPECT_THROW(rest(), OutputError);
      }
      const EventsHdf5Reader reader(cut);
      const std::vector<Event> left = reader.read(0, events.size());
      ASSERT_LE(left.size(), events.size());
      ASSERT_TRUE(std::equal(left.begin(), left.end(), events.begin())) << "limit " << limit;
      EXPECT_EQ(reader.complete(), false);
      max = std::max(max, reader.size());
    }
    EXPECT_GT(max, events.size() / 2);
  }
}

/// Every format that is a file: on a full disk, the output converted so far stays, and the message says where.
TEST(FullDisk, ConversionsKeepWhatTheyHave) {
  const test::TemporaryDirectory base;
  const std::vector<Event> events = test::random_events(1'500'000, 240, 180, 0, kNsPerSecond);
  const fs::path input = base.path() / "input.h5";
  {
    EventsHdf5Writer writer(input, 0);
    test::record(writer, test::recording_info(240, 180, 0, kNsPerSecond), events);
  }
  for (const Format& format : all_formats()) {
    if (!format.create || !format.can_hold(Content::events)) continue;
    SCOPED_TRACE(format.name);
    const fs::path out = base.path() / ("copy" + format.extension());
    const auto convert = [&] {
      const test::FileSizeLimit full(1'500'000);
      convert_recording(input, format, out, {.replace = true}, [](double) { return true; });
    };
    const std::string message = message_of<OutputError>(convert);
    EXPECT_TRUE(contains(message, "is kept: " + out.string() + ".incomplete"));
    EXPECT_FALSE(fs::exists(out));
    ASSERT_TRUE(fs::exists(out.string() + ".incomplete"));
    std::uintmax_t kept = 0;
    for (const auto& entry : fs::recursive_directory_iterator(base.path())) {
      if (entry.path().string().starts_with(out.string() + ".incomplete") && entry.is_regular_file())
        kept += entry.file_size();
    }
    EXPECT_GT(kept, 500'000U);

    // Like the file of a killed process: it can be read, in part or completely, or the error says what is wrong.
    try {
      ReadOptions options;
      options.recover = [](const std::string&) {};
      const auto source = open_source(out.string() + ".incomplete", options);
      while (source->next() != nullptr) continue;
    } catch (const UserError& error) {
      EXPECT_TRUE(contains(error.what(), out.string() + ".incomplete"));
    }
    convert_recording(input, format, out, {.replace = true}, [](double) { return true; });
    fs::remove_all(out);
    for (const auto& entry : fs::directory_iterator(base.path()))
      EXPECT_EQ(entry.path(), input) << "left by " << format.name;
  }
}

}  // namespace
}  // namespace esim
