#include "esim/recording/record_journal.h"

#include <gtest/gtest.h>

#include <array>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>

#include "esim/core/error.h"
#include "support/temporary_directory.h"

namespace esim {
namespace {

namespace fs = std::filesystem;

class Nowhere final : public Sink {
 public:
  void begin(const RecordingInfo&) override {}
  void write(const Record&) override {}
  void end(bool) override {}
};

std::string content_of(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

class Journal : public testing::Test {
 protected:
  /// Writes records of all kinds, so many of each, some of them empty.
  static void write_all(Sink& out, int count) {
    Image<float> a(5, 4, 0.5F), b(5, 4, std::numeric_limits<float>::infinity());
    const Image<std::uint16_t> object(5, 4, 3), none;
    const Image<std::uint8_t> visible(5, 4, 1);
    const SE3 pose{Eigen::Quaterniond(0.5, 0.5, -0.5, 0.5), {1, 2, 3}};
    const Kinematics motion{pose, {1, 2, 3}, {4, 5, 6}, {7, 8, 9}, {10, 11, 12}};
    const InertialSignals signals{{0.1, 0.2, 0.3}, {0.4, 0.5, 0.6}};
    for (int i = 0; i < count; ++i) {
      a(i % 5, 2) = static_cast<float>(i);
      static std::array<Event, 2> storage;  // static, so that the bytes between the members are 0
      for (Event& event : storage) event.t = i, event.x = 4, event.y = 3, event.polarity = -1;
      const EventSpan events = EventSpan(storage).first(static_cast<std::size_t>(i % 3));
      const std::vector<EventLabel> labels(events.size(), EventLabel{.t_ideal = i, .noise = 0.25F});
      const std::vector<Eigen::Vector3f> points(events.size(), Eigen::Vector3f(1, 2, static_cast<float>(i)));
      const std::vector<SE3> objects(static_cast<std::size_t>(i % 2), pose);
      out.write(EventsRecord{i, events, i % 2 == 0 ? LabelSpan(labels) : LabelSpan{}});
      out.write(TruthRecord{i, i, pose, a, b, a, b, i % 2 == 0 ? &object : nullptr, objects});
      out.write(OpticalFlowRecord{i, i, i + 1, a, b, visible});
      out.write(EventPointsRecord{i, events, points});
      out.write(ImageRecord{i, i, a});
      out.write(FrameRecord{i, i, i - 1, i + 1, 1.5, object, 12});
      out.write(PoseRecord{i, motion, {motion, motion}, i % 2 == 0 ? std::optional(signals) : std::nullopt});
      out.write(ImuRecord{i, signals, signals});
      out.write(TriggerRecord{i, i, TriggerKind::frame_end});
    }
  }

  /// Replays the first bytes of a journal into another one, and returns the content of that one.
  std::string replayed(const fs::path& file, std::uint64_t bytes) {
    const fs::path copy = folder_.path() / "copy";
    auto out = std::make_unique<RecordJournal>(copy, std::make_unique<Nowhere>());
    RecordJournal& inner = *out;
    RecordJournal journal(file, bytes, std::move(out));
    journal.begin({});
    inner.checkpoint();
    return content_of(copy);
  }

  test::TemporaryDirectory folder_;
};

TEST_F(Journal, PassesEveryRecordOnAgain) {
  const fs::path file = folder_.path() / "journal";
  RecordJournal journal(file, std::make_unique<Nowhere>());
  write_all(journal, 7);
  const std::uint64_t bytes = journal.checkpoint();
  const std::string content = content_of(file);
  EXPECT_EQ(bytes, content.size());
  EXPECT_TRUE(replayed(file, bytes) == content);
}

TEST_F(Journal, ContinuesAfterTheCheckpointAndForgetsTheRest) {
  const fs::path file = folder_.path() / "journal", expected = folder_.path() / "expected";
  std::uint64_t bytes = 0;
  {
    RecordJournal journal(file, std::make_unique<Nowhere>());
    write_all(journal, 3);
    bytes = journal.checkpoint();
    write_all(journal, 20'000);  // some of these reach the file
    EXPECT_GT(fs::file_size(file), bytes);
  }
  RecordJournal continued(file, bytes, std::make_unique<Nowhere>());
  continued.begin({});
  EXPECT_EQ(fs::file_size(file), bytes);
  write_all(continued, 5);
  continued.checkpoint();
  RecordJournal undisturbed(expected, std::make_unique<Nowhere>());
  write_all(undisturbed, 3);
  undisturbed.checkpoint();
  write_all(undisturbed, 5);
  undisturbed.checkpoint();
  EXPECT_TRUE(content_of(file) == content_of(expected));
}

TEST_F(Journal, RefusesDamage) {
  const fs::path file = folder_.path() / "journal";
  std::uint64_t first = 0, bytes = 0;
  {
    RecordJournal journal(file, std::make_unique<Nowhere>());
    write_all(journal, 2);
    first = journal.checkpoint();
    write_all(journal, 2);
    bytes = journal.checkpoint();
  }
  const std::string content = content_of(file);
  const auto write = [&](const std::string& text) { std::ofstream(file, std::ios::binary) << text; };
  const std::string one_block = replayed(file, bytes);
  std::uint64_t refused = 0;
  for (std::uint64_t length = 1; length < bytes; ++length) {
    write(content);
    if (length == first) {
      EXPECT_NO_THROW(replayed(file, length));
    } else {
      EXPECT_THROW(replayed(file, length), UserError) << length;
    }
    write(content.substr(0, length));
    EXPECT_THROW(replayed(file, bytes), UserError) << length;
    std::string changed = content;
    changed[length] = static_cast<char>(changed[length] ^ 0x40);
    write(changed);
    try {  // some bits mean nothing to the decoder
      EXPECT_TRUE(replayed(file, bytes) == one_block) << length;
    } catch (const UserError&) {
      ++refused;
    }
  }
  EXPECT_GT(refused, bytes * 9 / 10);
  EXPECT_THROW(RecordJournal(folder_.path() / "absent", 10, std::make_unique<Nowhere>()), UserError);
}

}  // namespace
}  // namespace esim
