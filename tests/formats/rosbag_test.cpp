#include <bzlib.h>
#include <gtest/gtest.h>

#include "esim/core/error.h"
#include "esim/formats/formats.h"
#include "esim/formats/ros/chunk_codec.h"
#include "esim/formats/ros/rosbag/bag_records.h"
#include "esim/formats/ros/rosbag/rosbag_input.h"
#include "esim/formats/ros/rosbag/rosbag_output.h"
#include "formats/ros_messages.h"
#include "support/errors.h"
#include "support/temporary_directory.h"

namespace esim {
namespace {

using rosbag::Op;
using rosbag::RecordWriter;

class Rosbag : public testing::Test {
 protected:
  /// A bag of these records, without an index.
  std::filesystem::path bag(const std::string& records) const {
    std::string bytes(rosbag::kMagic);
    RecordWriter(bytes, Op::bag_header)
        .field("index_pos", std::uint64_t{0})
        .field("conn_count", 0U)
        .field("chunk_count", 0U)
        .end(std::string(4000, ' '));
    return base_.write("test.bag", bytes + records);
  }

  std::string problem_of(const std::string& records) const {
    return test::read_back(bag(records)).problem.value_or("no problem");
  }

  static std::string chunk(std::string_view compression, std::string_view data, std::uint32_t size) {
    std::string record;
    RecordWriter(record, Op::chunk).text("compression", compression).field("size", size).end(data);
    return record;
  }

  test::TemporaryDirectory base_;
};

/// The content of a chunk: one IMU measurement at 7 ns.
std::string imu_messages() {
  std::string records, connection;
  for (const auto& [name, value] : {std::pair{"topic", "/imu"}, {"type", "sensor_msgs/Imu"}, {"md5sum", "*"}}) {
    rosbag::append_field(connection, name, value);
  }
  RecordWriter(records, Op::connection).field("conn", 3U).text("topic", "/imu").end(connection);
  RecordWriter(records, Op::message)
      .field("conn", 3U)
      .field("time", rosbag::to_ros(7))
      .end(test::encoded(ros::ImuMessage{.header = {7, "imu"}}, ros::Encoding::ros1));
  return records;
}

TEST_F(Rosbag, EveryCompressionIsRead) {
  const std::string raw = imu_messages();
  std::string lz4, bz2(raw.size() * 2 + 600, '\0');
  ros::compress(ros::ChunkCodec::lz4, raw, lz4);
  auto bz2_size = static_cast<unsigned>(bz2.size());
  ASSERT_EQ(BZ2_bzBuffToBuffCompress(bz2.data(), &bz2_size, const_cast<char*>(raw.data()),
                                     static_cast<unsigned>(raw.size()), 9, 0, 0),
            BZ_OK);
  bz2.resize(bz2_size);
  const auto size = static_cast<std::uint32_t>(raw.size());
  for (const std::string& records : {chunk("none", raw, size), chunk("lz4", lz4, size), chunk("bz2", bz2, size), raw}) {
    const test::ReadBack all = test::read_back(bag(records));
    ASSERT_EQ(all.imu.size(), 1U);
    EXPECT_EQ(all.imu[0].t, 7);
    EXPECT_TRUE(all.problem && test::contains(*all.problem, "without an index")) << "as after a killed writer";
  }
}

TEST_F(Rosbag, SizesThatAreNotTrueAreNamed) {
  const std::string raw = imu_messages();
  std::string lz4;
  ros::compress(ros::ChunkCodec::lz4, raw, lz4);
  const auto size = static_cast<std::uint32_t>(raw.size());
  EXPECT_TRUE(test::contains(problem_of(chunk("lz4", lz4, size - 1)), "damaged"));
  EXPECT_TRUE(test::contains(problem_of(chunk("lz4", lz4, size + 1)), "damaged"));
  EXPECT_TRUE(test::contains(problem_of(chunk("lz4", lz4, 0xffffffff)), "larger than any chunk"));
  EXPECT_TRUE(test::contains(problem_of(chunk("lz4", lz4, ros::kMaxChunkBytes)), "damaged"))
      << "and allocates no memory";
  EXPECT_TRUE(test::contains(problem_of(chunk("snappy", lz4, size)), "snappy"));
  EXPECT_TRUE(test::contains(problem_of("\xff\xff\xff\xff"), "4294967295 bytes"));
  EXPECT_TRUE(test::contains(problem_of(std::string("\0\0\0\0\xff\xff\xff\xff", 8)), "4294967295 bytes"));
  EXPECT_TRUE(test::contains(problem_of(std::string("\0\0\0\0\xff\xff\0\0", 8)), "ends within a record's data"));
  EXPECT_TRUE(test::contains(problem_of(std::string("\0\0\0\0\0\0\0\0", 8)), "no field \"op\""));
  const std::string field_beyond("\4\0\0\0\xff\0\0\0\0\0\0\0", 12);
  EXPECT_TRUE(test::contains(problem_of(field_beyond), "ends too early"));
}

TEST_F(Rosbag, OlderOnesAndEncryptedOnesAreRefused) {
  const auto old = base_.write("old.bag", "#ROSBAG V1.2\n" + std::string(100, '\0'));
  EXPECT_TRUE(test::contains(test::message_of<UserError>([&] { open_source(old); }), "must have version 2.0"));
  std::string bytes(rosbag::kMagic);
  RecordWriter(bytes, Op::bag_header)
      .field("index_pos", std::uint64_t{0})
      .text("encryptor", "rosbag/AesCbcEncryptor")
      .end("");
  const auto encrypted = base_.write("encrypted.bag", bytes);
  EXPECT_TRUE(test::contains(test::message_of<UserError>([&] { open_source(encrypted); }), "encrypted"));
}

TEST_F(Rosbag, TheIndexLeadsToEveryMessage) {
  const auto path = base_.path() / "whole.bag";
  rosbag::RosbagOutput output(path, ros::ChunkCodec::none);
  const std::string payload(300'000, 'x');
  for (TimeNs t = 1; t <= 9; ++t) output.write(t % 2 == 0 ? "/even" : "/odd", ros::MessageType::imu, t, payload);
  output.close();

  const std::string bytes = test::content(path);
  const auto number_at = [&](std::size_t at) {
    return load_unaligned<std::uint32_t>(ros::as_bytes(bytes).data() + at);
  };
  std::size_t chunks = 0, messages = 0, connections = 0, chunk_start = 0, chunk_data = 0;
  std::vector<std::size_t> chunk_positions, indexed_positions;
  for (std::size_t at = rosbag::kMagic.size(); at < bytes.size();) {
    const std::size_t start = at;
    const auto header = ros::as_bytes(bytes).subspan(at + 4, number_at(at));
    at += 4 + header.size();
    const auto data = ros::as_bytes(bytes).subspan(at + 4, number_at(at));
    at += 4 + data.size();
    switch (rosbag::field<Op>(header, "op")) {
      case Op::bag_header:
        EXPECT_EQ(at, rosbag::kMagic.size() + 8 + 4096);
        EXPECT_EQ(rosbag::field<std::uint32_t>(header, "conn_count"), 2U);
        EXPECT_EQ(rosbag::field<std::uint32_t>(header, "chunk_count"), 3U);
        break;
      case Op::chunk:
        ++chunks, chunk_start = start, chunk_data = static_cast<std::size_t>(ros::as_text(data).data() - bytes.data());
        chunk_positions.push_back(chunk_start);
        break;
      case Op::index:
        for (ros::ByteReader entries(data); entries.left() > 0; ++messages) {
          const auto time = entries.number<std::uint64_t>();
          const std::size_t record = chunk_data + entries.number<std::uint32_t>();
          const auto message = ros::as_bytes(bytes).subspan(record + 4, number_at(record));
          EXPECT_EQ(rosbag::field<Op>(message, "op"), Op::message);
          EXPECT_EQ(rosbag::field<std::uint64_t>(message, "time"), time);
        }
        break;
      case Op::connection:
        ++connections;
        break;
      case Op::chunk_info:
        indexed_positions.push_back(rosbag::field<std::uint64_t>(header, "chunk_pos"));
        break;
      default:
        FAIL() << "a message outside of chunks";
    }
  }
  EXPECT_EQ(std::tuple(chunks, messages, connections), std::tuple(3U, 9U, 2U));
  EXPECT_EQ(indexed_positions, chunk_positions);
  EXPECT_EQ(rosbag::RosbagInput(path).times()->start, 1);
  EXPECT_EQ(rosbag::RosbagInput(path).times()->end, 9);
}

}  // namespace
}  // namespace esim
