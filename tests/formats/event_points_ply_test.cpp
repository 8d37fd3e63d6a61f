#include "esim/formats/recording_folder/event_points_ply.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <sstream>

#include "esim/core/error.h"
#include "formats/recordings.h"
#include "support/temporary_directory.h"

namespace esim {
namespace {

/// A vertex in the layout of the header.
struct Vertex {
  float x, y, z;
  double t;
  std::uint16_t u, v;
  std::int8_t polarity;
};

/// Reads the file by its header, like any PLY reader.
std::vector<Vertex> read_ply(const std::filesystem::path& path) {
  const std::string content = test::content(path);
  const std::string end = "end_header\n";
  const std::size_t body = content.find(end) + end.size();
  std::istringstream header(content.substr(0, body));
  std::string line, properties;
  std::getline(header, line);
  EXPECT_EQ(line, "ply");
  std::getline(header, line);
  EXPECT_EQ(line, "format binary_little_endian 1.0");
  std::size_t count = 0;
  while (std::getline(header, line)) {
    std::istringstream words(line);
    std::string first, second;
    words >> first >> second;
    if (first == "element") words >> count;
    if (first == "property") properties += line.substr(9) + ",";
  }
  EXPECT_EQ(properties, "float x,float y,float z,double t,ushort u,ushort v,char polarity,");
  constexpr std::size_t kBytes = 25;
  EXPECT_EQ(content.size(), body + kBytes * count);
  std::vector<Vertex> vertices(count);
  for (std::size_t i = 0; i < count; ++i) {
    const char* at = content.data() + body + kBytes * i;
    for (float* number : {&vertices[i].x, &vertices[i].y, &vertices[i].z})
      std::memcpy(number, std::exchange(at, at + 4), 4);
    std::memcpy(&vertices[i].t, std::exchange(at, at + 8), 8);
    std::memcpy(&vertices[i].u, std::exchange(at, at + 2), 2);
    std::memcpy(&vertices[i].v, std::exchange(at, at + 2), 2);
    std::memcpy(&vertices[i].polarity, at, 1);
  }
  return vertices;
}

TEST(EventPointsPly, IsCompleteWheneverItIsRead) {
  const test::TemporaryDirectory directory;
  const auto path = directory.path() / "points.ply";
  const std::vector<Event> events = test::random_events(5000, 640, 480, 0, kNsPerSecond);
  std::vector<Eigen::Vector3f> points;
  for (std::size_t i = 0; i < events.size(); ++i) {
    const auto f = static_cast<float>(i);
    points.emplace_back(f, -0.5F * f, i % 5 == 0 ? std::numeric_limits<float>::quiet_NaN() : 1 / (f + 1));
  }
  EventPointsPlyWriter writer(path, 0);
  writer.begin(test::recording_info(640, 480, 0, kNsPerSecond));
  EXPECT_TRUE(read_ply(path).empty());
  constexpr std::size_t kPart = 1000;
  for (std::size_t done = 0; done < events.size(); done += kPart) {
    const auto part = EventSpan(events).subspan(done, kPart);
    writer.write(EventPointsRecord{0, part, std::span(points).subspan(done, kPart)});
    writer.write(EventPointsRecord{1, part, std::span(points).subspan(done, kPart)});
    writer.write(EventsRecord{0, part});
    EXPECT_EQ(read_ply(path).size(), (done + kPart) * 4 / 5);
  }
  writer.end(true);

  const std::vector<Vertex> found = read_ply(path);
  ASSERT_EQ(found.size(), 4000U);
  for (std::size_t i = 0, k = 0; i < events.size(); ++i) {
    if (i % 5 == 0) continue;  // events without a point
    const Vertex& vertex = found[k++];
    ASSERT_EQ(Eigen::Vector3f(vertex.x, vertex.y, vertex.z), points[i]);
    ASSERT_EQ(vertex.t, to_seconds(events[i].t));
    ASSERT_EQ(vertex.u, events[i].x);
    ASSERT_EQ(vertex.v, events[i].y);
    ASSERT_EQ(vertex.polarity, events[i].polarity);
  }
}

TEST(EventPointsPly, FullDisk) {
  const test::TemporaryDirectory directory;
  const std::vector<Event> events = test::random_events(5000, 640, 480, 0, kNsPerSecond);
  const std::vector<Eigen::Vector3f> points(events.size(), Eigen::Vector3f::Zero());
  const test::FileSizeLimit full(20'000);
  EventPointsPlyWriter writer(directory.path() / "points.ply", 0);
  writer.begin(test::recording_info(640, 480, 0, kNsPerSecond));
  EXPECT_THROW(writer.write(EventPointsRecord{0, events, points}), OutputError);
}

}  // namespace
}  // namespace esim
