// AEDAT 4 features other than the events of one camera, which every_format_test.cpp covers.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>

#include "esim/core/error.h"
#include "esim/formats/aedat4/description.h"
#include "esim/formats/aedat4/packing.h"
#include "esim/formats/formats.h"
#include "formats/recorded.h"
#include "formats/recordings.h"
#include "support/errors.h"
#include "support/numeric.h"
#include "support/temporary_directory.h"

namespace esim {
namespace {

namespace fs = std::filesystem;
using aedat4::Packing;

constexpr TimeNs kEnd = kNsPerSecond;

class Aedat4 : public testing::Test {
 protected:
  Aedat4() {
    info_.cameras.push_back(info_.cameras[0]);
    info_.cameras[0].name = "left";
    info_.cameras[1].name = "right";
    for (int camera = 0; camera < 2; ++camera) {
      for (int i = 1; i <= 3; ++i)
        frames_.push_back(test::gradient_frame(camera, i * 100 * kNsPerMs, 64, 48, 8 + 4 * camera, i));
    }
    for (int i = 0; i < 3000; ++i) {
      ImuRecord imu{.t = i * 250 * kNsPerUs};
      imu.measured.angular_rate = Eigen::Vector3d(0.1 * i, -1, 2);
      imu.measured.specific_force = Eigen::Vector3d(0, 9.81, -0.01 * i);
      imu_.push_back(imu);
    }
  }

  static std::vector<Event> events(unsigned seed) {
    std::vector<Event> all = test::random_events(50'000, 64, 48, 0, kEnd, seed);
    for (Event& event : all) event.t -= event.t % kNsPerUs;
    return all;
  }

  fs::path write(const char* format, Compression compression = Compression::blosc) const {
    const fs::path path = base_.path() / "file.aedat4";
    const auto sink = format_named(format).create(path, {TimeUnit::us, compression});
    sink->begin(info_);
    for (const int camera : {0, 1}) sink->write(EventsRecord{camera, events_[camera]});
    for (const test::OwnedFrame& frame : frames_) sink->write(frame.record());
    for (const ImuRecord& imu : imu_) sink->write(imu);
    for (const TriggerRecord& trigger : triggers_) sink->write(trigger);
    sink->end(true);
    return path;
  }

  test::TemporaryDirectory base_;
  RecordingInfo info_ = test::recording_info(64, 48, 0, kEnd);
  std::vector<Event> events_[2] = {events(1), events(2)};
  std::vector<test::OwnedFrame> frames_;
  std::vector<ImuRecord> imu_;
  std::vector<TriggerRecord> triggers_ = {{0, 20 * kNsPerMs, TriggerKind::external_rising},
                                          {1, 30 * kNsPerMs, TriggerKind::timestamp_reset},
                                          {0, 40 * kNsPerMs, TriggerKind::external_falling}};
};

TEST_F(Aedat4, TwoCamerasFramesAndTheImuReadBack) {
  for (const char* format : {"aedat4", "aedat4-zstd"}) {
    for (const Compression compression : {Compression::blosc, Compression::none}) {
      const test::Recorded found = test::read_all(write(format, compression));
      ASSERT_EQ(found.info.cameras.size(), 2U);
      EXPECT_EQ(found.info.cameras[0].name, "left");
      EXPECT_EQ(found.info.cameras[1].name, "right");
      EXPECT_EQ(found.info.cameras[1].model.width, 64);
      EXPECT_EQ(found.info.cameras[1].model.height, 48);
      EXPECT_TRUE(found.info.imu);
      EXPECT_EQ(found.info.start, 0);
      EXPECT_EQ(found.info.end, std::max(events_[0].back().t, events_[1].back().t));
      EXPECT_EQ(found.events[0], events_[0]);
      EXPECT_EQ(found.events[1], events_[1]);

      ASSERT_EQ(found.frames.size(), frames_.size());
      for (std::size_t i = 0; i < frames_.size(); ++i) {
        EXPECT_EQ(found.frames[i].camera, frames_[i].camera);
        EXPECT_EQ(found.frames[i].t, frames_[i].t);
        EXPECT_EQ(found.frames[i].exposure_start, frames_[i].exposure_start);
        EXPECT_EQ(found.frames[i].exposure_duration, frames_[i].exposure_duration);
        EXPECT_EQ(found.frames[i].bits, frames_[i].bits > 8 ? 16 : 8);
        EXPECT_TRUE(std::ranges::equal(found.frames[i].image.pixels(), frames_[i].image.pixels())) << i;
      }
      // Triggers of each camera are in order; frames replace exposure triggers.
      const auto same = [](const TriggerRecord& a, const TriggerRecord& b) { return a.t == b.t && a.kind == b.kind; };
      for (const int camera : {0, 1}) {
        std::vector<TriggerRecord> expected = triggers_, triggers = found.triggers;
        for (auto* all : {&expected, &triggers})
          std::erase_if(*all, [&](const TriggerRecord& trigger) { return trigger.camera != camera; });
        EXPECT_TRUE(std::ranges::equal(triggers, expected, same)) << camera;
      }
      ASSERT_EQ(found.imu.size(), imu_.size());
      for (std::size_t i = 0; i < imu_.size(); ++i) {
        const InertialSignals &was = imu_[i].measured, &is = found.imu[i].measured;
        EXPECT_EQ(found.imu[i].t, imu_[i].t);
        EXPECT_LT(test::largest_difference(is.angular_rate, was.angular_rate), 1e-6 * was.angular_rate.norm());
        EXPECT_LT(test::largest_difference(is.specific_force, was.specific_force), 1e-6 * was.specific_force.norm());
      }
    }
  }
}

TEST_F(Aedat4, TheSameRecordsGiveTheSameBytes) {
  const std::string first = test::content(write("aedat4"));
  EXPECT_EQ(test::content(write("aedat4")), first);
}

TEST_F(Aedat4, WithoutItsTableOfPacketsAFileIsReadToItsLastWholePacket) {
  const std::string bytes = test::content(write("aedat4"));
  const fs::path cut = base_.write("cut.aedat4", bytes.substr(0, bytes.size() / 3));
  std::string problem;
  ReadOptions options{.recover = [&](const std::string& what) { problem = what; }};
  const test::Recorded found = test::read_all(cut, options);
  EXPECT_TRUE(test::contains(problem, "the file ends within a packet"));
  EXPECT_TRUE(test::contains(problem, "at byte " + std::to_string(bytes.size() / 3))) << problem;
  ASSERT_GT(found.events[0].size(), 10'000U);
  EXPECT_TRUE(std::equal(found.events[0].begin(), found.events[0].end(), events_[0].begin()));
}

TEST_F(Aedat4, FramesWhoseSizeIsALieAreRefused) {
  for (auto& events : events_) events.clear();
  frames_ = {test::gradient_frame(0, kNsPerMs, 0x25, 0x1b, 8, 1)};
  std::string bytes = test::content(write("aedat4", Compression::none));
  const std::string size("\x25\0\x1b\0", 4), reversed("\x1b\0\x25\0", 4);
  std::size_t at = bytes.find(size);
  if (at == std::string::npos) at = bytes.find(reversed);
  ASSERT_NE(at, std::string::npos);
  bytes[at + 1] = 0x7f;
  const fs::path path = base_.write("lie.aedat4", bytes);
  EXPECT_TRUE(test::contains(test::message_of<UserError>([&] { test::read_all(path); }), "damaged frame: "));
}

TEST_F(Aedat4, SizesOfPacketsAreNotBelieved) {
  const std::string bytes = test::content(write("aedat4"));
  std::uint32_t head = 0;
  std::memcpy(&head, &bytes[14], sizeof(head));
  for (const std::int32_t size : {-1, std::numeric_limits<std::int32_t>::max(), 1 << 27}) {
    std::string damaged = bytes;
    std::memcpy(&damaged[14 + 4 + head + 4], &size, sizeof(size));
    const fs::path path = base_.write("sizes.aedat4", damaged);
    const std::string message = test::message_of<UserError>([&] { test::read_all(path); });
    EXPECT_TRUE(test::contains(message, "packet")) << size;
    EXPECT_TRUE(test::contains(message, "at byte")) << message;
  }
}

TEST(Aedat4Packing, RoundTripsAndTakesMemoryForWhatIsThereOnly) {
  for (const Packing packing : {Packing::none, Packing::lz4, Packing::lz4_high, Packing::zstd, Packing::zstd_high}) {
    aedat4::Packer packer(packing);
    aedat4::Unpacker unpacker(packing, 1 << 20);
    for (const std::size_t size : {0, 1, 1000, 70'000, 1 << 20}) {
      const std::string plain(size, 'x');
      const std::string packed(packer.pack(plain));
      const auto unpacked = unpacker.unpack(std::as_bytes(std::span(packed)));
      ASSERT_TRUE(unpacked) << name_of(packing) << " " << size;
      EXPECT_EQ(std::string(reinterpret_cast<const char*>(unpacked->data()), unpacked->size()), plain);
      if (packing == Packing::none) continue;
      for (const std::size_t kept : {packed.size() / 2, packed.size() - 1}) {
        EXPECT_FALSE(unpacker.unpack(std::as_bytes(std::span(packed).first(kept)))) << name_of(packing);
      }
    }
    if (packing == Packing::none) continue;
    const std::string bomb(packer.pack(std::string((1 << 22) + 1, '\0')));
    EXPECT_LT(bomb.size(), 1U << 16);
    EXPECT_FALSE(unpacker.unpack(std::as_bytes(std::span(bomb)))) << name_of(packing);
  }
}

TEST(Aedat4Description, NamesAreEscapedAndReadBack) {
  const std::vector<aedat4::Stream> streams = {{3, "EVTS", "a<b>&\"c\"'", 640, 480}, {7, "IMUS", "&lt;"}};
  const auto found = aedat4::parse_description(aedat4::describe(streams, "LZ4"));
  ASSERT_TRUE(found);
  ASSERT_EQ(found->size(), 2U);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_EQ((*found)[i].id, streams[i].id);
    EXPECT_EQ((*found)[i].type, streams[i].type);
    EXPECT_EQ((*found)[i].source, streams[i].source);
    EXPECT_EQ((*found)[i].width, streams[i].width);
    EXPECT_EQ((*found)[i].height, streams[i].height);
  }
}

TEST(Aedat4Description, DamageIsNoticedOrDoesNoHarm) {
  const std::string xml = aedat4::describe({{0, "EVTS", "cam0", 640, 480}}, "LZ4");
  for (std::size_t size = 0; size < xml.size(); ++size)
    aedat4::parse_description(std::string_view(xml).substr(0, size));
  std::string deep;
  for (int i = 0; i < 1000; ++i) deep += "<node name=\"outInfo\">";
  EXPECT_FALSE(aedat4::parse_description(deep));
  EXPECT_FALSE(aedat4::parse_description("</node>"));
  EXPECT_FALSE(aedat4::parse_description("<node name=\"outInfo\"><node"));
}

}  // namespace
}  // namespace esim
