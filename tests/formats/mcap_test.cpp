#include <gtest/gtest.h>

#include "esim/core/error.h"
#include "esim/formats/formats.h"
#include "esim/formats/ros/mcap/mcap_input.h"
#include "esim/formats/ros/mcap/mcap_output.h"
#include "esim/formats/ros/mcap/mcap_records.h"
#include "formats/ros_messages.h"
#include "support/errors.h"
#include "support/temporary_directory.h"

namespace esim {
namespace {

using mcap::Op;
using mcap::RecordWriter;

class Mcap : public testing::Test {
 protected:
  /// A file of these records, without a summary.
  std::filesystem::path file(const std::string& records) const {
    std::string bytes(mcap::kMagic);
    RecordWriter(bytes, Op::header).text("ros2").text("test");
    bytes += records;
    RecordWriter(bytes, Op::data_end).number(0U);
    RecordWriter(bytes, Op::footer).number(std::uint64_t{0}).number(std::uint64_t{0}).number(0U);
    bytes += mcap::kMagic;
    return base_.write("test.mcap", bytes);
  }

  std::string problem_of(const std::string& records) const {
    return test::read_back(file(records)).problem.value_or("no problem");
  }

  static std::string chunk(std::string_view compression, std::string_view packed, std::uint64_t size,
                           std::uint32_t crc = 0) {
    std::string record;
    RecordWriter(record, Op::chunk)
        .number(std::uint64_t{0})
        .number(std::uint64_t{0})
        .number(size)
        .number(crc)
        .text(compression)
        .number(std::uint64_t{packed.size()})
        .bytes(packed);
    return record;
  }

  test::TemporaryDirectory base_;
};

/// One measurement of an IMU at 7 ns.
std::string imu_messages(ros::Encoding encoding, std::string_view schema, std::string_view name) {
  std::string records;
  RecordWriter(records, Op::schema).number(std::uint16_t{5}).text(schema).text("").text("");
  RecordWriter(records, Op::channel).number(std::uint16_t{9}).number(std::uint16_t{5}).text("/imu").text(name).text("");
  RecordWriter(records, Op::message)
      .number(std::uint16_t{9})
      .number(0U)
      .number(std::uint64_t{7})
      .number(std::uint64_t{7})
      .bytes(test::encoded(ros::ImuMessage{.header = {7, "imu"}}, encoding));
  return records;
}

TEST_F(Mcap, EveryCompressionAndBothEncodingsAreRead) {
  const std::string raw = imu_messages(ros::Encoding::cdr, "sensor_msgs/msg/Imu", "cdr");
  std::string lz4, zstd;
  ros::compress(ros::ChunkCodec::lz4, raw, lz4);
  ros::compress(ros::ChunkCodec::zstd, raw, zstd);
  for (const std::string& records :
       {raw, chunk("", raw, raw.size()), chunk("lz4", lz4, raw.size()), chunk("zstd", zstd, raw.size()),
        imu_messages(ros::Encoding::ros1, "sensor_msgs/Imu", "ros1")}) {
    const test::ReadBack all = test::read_back(file(records));
    EXPECT_FALSE(all.problem) << *all.problem;
    ASSERT_EQ(all.imu.size(), 1U);
    EXPECT_EQ(all.imu[0].t, 7);
  }
  const auto json = file(imu_messages(ros::Encoding::cdr, "sensor_msgs/msg/Imu", "json"));
  EXPECT_TRUE(test::contains(test::message_of<UserError>([&] { open_source(json); }), "(sensor_msgs/msg/Imu in json)"));
}

TEST_F(Mcap, SizesAndChecksumsThatAreNotTrueAreNamed) {
  const std::string raw = imu_messages(ros::Encoding::cdr, "sensor_msgs/msg/Imu", "cdr");
  std::string zstd;
  ros::compress(ros::ChunkCodec::zstd, raw, zstd);
  EXPECT_TRUE(test::contains(problem_of(chunk("zstd", zstd, raw.size() - 1)), "damaged"));
  EXPECT_TRUE(test::contains(problem_of(chunk("zstd", zstd, ros::kMaxChunkBytes)), "damaged"))
      << "and allocates no memory";
  EXPECT_TRUE(test::contains(problem_of(chunk("zstd", zstd, ~0ULL)), "larger than any chunk"));
  EXPECT_TRUE(test::contains(problem_of(chunk("brotli", zstd, raw.size())), "brotli"));
  EXPECT_TRUE(test::contains(problem_of(chunk("", raw, raw.size(), 12345)), "checksum"));
  std::string endless(1, static_cast<char>(Op::message));
  ros::append_number(endless, ~0ULL);
  EXPECT_TRUE(test::contains(problem_of(endless), "18446744073709551615 bytes"));
  EXPECT_TRUE(test::contains(problem_of(chunk("", endless, endless.size())), "ends too early"));
  const std::string nested = chunk("", raw, raw.size());
  const auto doubled = file(chunk("", nested, nested.size()));
  EXPECT_TRUE(test::contains(test::message_of<UserError>([&] { open_source(doubled); }), "it holds no topics"))
      << "chunks hold no chunks";
}

TEST_F(Mcap, TheSummaryTellsTheEndAndTheChannels) {
  const auto path = base_.path() / "whole.mcap";
  mcap::McapOutput output(path, ros::ChunkCodec::zstd);
  const std::string payload(300'000, 'x');
  for (TimeNs t = 1; t <= 9; ++t) output.write(t % 2 == 0 ? "/even" : "/odd", ros::MessageType::imu, t, payload);
  output.close();
  const mcap::McapInput whole(path);
  EXPECT_EQ(whole.times()->start, 1);
  EXPECT_EQ(whole.times()->end, 9);
  EXPECT_EQ(whole.channels().size(), 2U);

  std::string bytes = test::content(path);
  bytes[bytes.size() - mcap::kMagic.size() - mcap::kFooterBytes] = 0;
  const mcap::McapInput without(base_.write("without.mcap", bytes));
  EXPECT_FALSE(without.times());
}

}  // namespace
}  // namespace esim
