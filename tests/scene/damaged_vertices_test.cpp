// Damaged point caches and numbered meshes.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <optional>

#include "esim/core/error.h"
#include "scene/loaded_vertices.h"
#include "support/errors.h"
#include "support/temporary_directory.h"

namespace esim {
namespace {

using test::Frames;
using test::kTriangle;
using test::load_with_vertices;
using test::mdd;
using test::pc2;
using test::triangle_frames;

/// The one-line error of reading files, which names `file`.
std::string refusal(const std::filesystem::path& mesh, const VertexFile& vertices, const std::string& file) {
  const std::string message = test::message_of<UserError>([&] { load_with_vertices(mesh, vertices); });
  EXPECT_EQ(message.find('\n'), std::string::npos) << message;
  EXPECT_TRUE(test::contains(message, file));
  return message;
}

class DamagedVertices : public testing::Test {
 protected:
  std::string refused_pc2(const std::string& bytes, std::optional<double> rate_hz = 24.0) const {
    return refusal(obj_, {folder_.write("a.pc2", bytes), rate_hz}, "a.pc2");
  }
  std::string refused_mdd(const std::string& bytes) const {
    return refusal(obj_, {folder_.write("a.mdd", bytes)}, "a.mdd");
  }
  std::string refused_sequence(const std::string& pattern, const std::string& file) const {
    return refusal(obj_, {folder_.path() / pattern, 24.0}, file);
  }

  test::TemporaryDirectory folder_;
  std::filesystem::path obj_ = folder_.write("a.obj", kTriangle);
};

template <typename T>
std::string changed(std::string bytes, std::size_t at, T value) {
  std::memcpy(bytes.data() + at, &value, sizeof value);
  return bytes;
}

TEST_F(DamagedVertices, Pc2) {
  const std::string good = pc2(triangle_frames(4));
  for (std::size_t size = 0; size < good.size(); ++size) {
    const std::string message = refused_pc2(good.substr(0, size));
    EXPECT_TRUE(size < 32 ? test::contains(message, "32 bytes of the header")
                          : test::contains(message, "must have 176 bytes for 4 frames of 3 vertices"));
  }
  EXPECT_TRUE(test::contains(refused_pc2(good + "x"), "but has 177"));
  EXPECT_TRUE(test::contains(refused_pc2("X" + good.substr(1)), "header of a PC2"));
  EXPECT_TRUE(test::contains(refused_pc2(changed(good, 12, 2)), "version 2"));
  EXPECT_TRUE(test::contains(refused_pc2(changed(good, 16, 4)), "has 4 vertices, but the mesh has 3"));
  EXPECT_TRUE(test::contains(refused_pc2(changed(good, 16, -3)), "has -3 vertices"));
  EXPECT_TRUE(test::contains(refused_pc2(changed(good, 28, 0)), "has 0 samples"));
  EXPECT_TRUE(test::contains(refused_pc2(changed(good, 28, 1 << 20)), "must have"));
  EXPECT_TRUE(test::contains(refused_pc2(changed(good, 28, (1 << 20) + 1)), "kept in memory"));
  EXPECT_TRUE(test::contains(refused_pc2(changed(good, 28, std::numeric_limits<int>::max())), "kept in memory"));
  EXPECT_TRUE(test::contains(refused_pc2(changed(good, 24, 0.0F)), "0 frames apart"));
  EXPECT_TRUE(test::contains(refused_pc2(changed(good, 24, -1.0F)), "-1 frames apart"));
  EXPECT_TRUE(test::contains(refused_pc2(changed(good, 24, std::nanf(""))), "nan frames apart"));
  EXPECT_TRUE(test::contains(refused_pc2(changed(good, 32 + 12 * 4, std::nanf(""))), "vertex 1 of frame 1"));
  EXPECT_TRUE(test::contains(refused_pc2(changed(good, 32, HUGE_VALF)), "vertex 0 of frame 0"));
  EXPECT_TRUE(test::contains(refused_pc2(changed(good, 32, 2e9F)), "at most 1e9"));
  EXPECT_TRUE(test::contains(refused_pc2(good, std::nullopt), "set rate_hz"));
  for (const double rate_hz : {0.0, -24.0, std::nan(""), 1e-7, 1e9, HUGE_VAL})
    EXPECT_TRUE(test::contains(refused_pc2(good, rate_hz), "rate_hz must be positive")) << rate_hz;
}

TEST_F(DamagedVertices, Mdd) {
  const std::string good = mdd(triangle_frames(3), {0, 1, 2});
  for (std::size_t size = 0; size < good.size(); ++size) {
    const std::string message = refused_mdd(good.substr(0, size));
    EXPECT_TRUE(size < 8 ? test::contains(message, "ends within the header")
                         : test::contains(message, "must have 128 bytes for 3 frames of 3 vertices"));
  }
  EXPECT_TRUE(test::contains(refused_mdd(good + "x"), "but has 129"));
  EXPECT_TRUE(test::contains(refused_mdd(changed(good, 0, 3)), "has 50331648 frames"));  // little-endian
  EXPECT_TRUE(test::contains(refused_mdd(changed(good, 0, 0x7f)), "kept in memory"));
  EXPECT_TRUE(test::contains(refused_mdd(changed(good, 0, -1)), "has -1 frames"));
  EXPECT_TRUE(test::contains(refused_mdd(changed(good, 4, 0)), "has 0 vertices"));
  EXPECT_TRUE(test::contains(refused_mdd(mdd(triangle_frames(3), {0, 2, 1})), "frame 2 is at 1 s, but frame 1 at 2 s"));
  EXPECT_TRUE(test::contains(refused_mdd(mdd(triangle_frames(3), {0, 1, 1})), "times must increase"));
  EXPECT_TRUE(test::contains(refused_mdd(mdd(triangle_frames(3), {0, std::nanf(""), 1})), "frame 1 is at nan s"));
  EXPECT_TRUE(test::contains(refused_mdd(mdd(triangle_frames(3), {0, 1, HUGE_VALF})), "times must be finite"));
  Frames infinite = triangle_frames(3);
  infinite[2][0].x() = -HUGE_VALF;
  EXPECT_TRUE(test::contains(refused_mdd(mdd(infinite, {0, 1, 2})), "vertex 0 of frame 2"));
  const VertexFile with_rate{folder_.write("b.mdd", good), 24.0};
  EXPECT_TRUE(test::contains(refusal(obj_, with_rate, "b.mdd"), "rate_hz must not be given"));
}

TEST_F(DamagedVertices, NumberedMeshes) {
  EXPECT_TRUE(test::contains(refused_sequence("x_##.obj", "x_##.obj"), "no file has such a name"));
  EXPECT_TRUE(test::contains(refused_sequence("none/x_##.obj", "x_##.obj"), "cannot be read"));
  EXPECT_TRUE(test::contains(refused_sequence("a.obj", "a.obj"), "one run of #"));
  EXPECT_TRUE(test::contains(refused_sequence("#_#.obj", "#_#.obj"), "one run of #"));
  for (const int number : {1, 2, 5, 7}) folder_.write("x_0" + std::to_string(number) + ".obj", kTriangle);
  for (const char* const other : {"x_3.obj", "x_003.obj", "x_-3.obj", "x_03.objx", "xx_03.obj", "x_0a.obj", "x_03.ply"})
    folder_.write(other, kTriangle);
  EXPECT_TRUE(test::contains(refused_sequence("x_##.obj", "x_##.obj"), "3 of the frames 1 to 7 are missing: 3, 4, 6"));
  for (const int number : {3, 4, 6}) folder_.write("x_0" + std::to_string(number) + ".obj", kTriangle);
  EXPECT_EQ(load_with_vertices(obj_, {folder_.path() / "x_##.obj", 1.0}).object.deformation->span().end, to_ns(6));

  const auto fourth = [&](const std::string& text) {
    folder_.write("x_04.obj", text);
    return refused_sequence("x_##.obj", "x_04.obj");
  };
  EXPECT_TRUE(test::contains(fourth(kTriangle + "v 1 1 1\n"), "has 4 vertices, but"));
  EXPECT_TRUE(test::contains(fourth("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 3 2\n"), "its faces are not those of"));
  EXPECT_TRUE(test::contains(fourth(kTriangle + "f 1 2 3\n"), "its faces are not those of"));
  EXPECT_TRUE(test::contains(fourth(""), "has no vertices"));
  EXPECT_TRUE(test::contains(fourth("v 0 0 nan\n"), "vertex 0 is at (0, 0, nan)"));
  EXPECT_TRUE(test::contains(fourth("\nv 0 0 x\n"), "line 2: 'x' is not a coordinate"));
  EXPECT_TRUE(test::contains(fourth("v 0 0\n"), "line 1: a vertex must have 3 coordinates, not 2"));
  EXPECT_TRUE(test::contains(fourth("v 0 0 0 1\n"), "not 4"));
  EXPECT_TRUE(test::contains(fourth("v 0 0 0\nf -2 1 1\n"), "'-2' is not the number of a vertex"));
  EXPECT_TRUE(test::contains(fourth("v 0 0 0\nf 0 1 1\n"), "'0' is not the number"));
  EXPECT_TRUE(test::contains(fourth("v 0 0 0\nf x 1 1\n"), "'x' is not the number"));
  EXPECT_TRUE(test::contains(fourth("v 0 0 0\nf 99999999999 1 1\n"), "is missing"));
  // Only the numbers of the vertices count.
  folder_.write("x_04.obj",
                "o x\nv 1e0 -1E-400 1e-400 0.5 0.5 0.5\r\nv 1 0 0 # here\nv\t0 1 0\nvt 0 0\nf 1/1 -2/1 \\\n3/1\n");
  EXPECT_EQ(load_with_vertices(obj_, {folder_.path() / "x_##.obj", 1.0}).object.deformation->span().end, to_ns(6));
}

TEST_F(DamagedVertices, NumberedPly) {
  const std::vector<Eigen::Vector3f> corners = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  const std::string good = test::ply(corners, {{0, 1, 2}}, true);
  const auto mesh = folder_.write("a.ply", good);
  folder_.write("p_1.ply", good);
  const auto second = [&](const std::string& bytes) {
    folder_.write("p_2.ply", bytes);
    return refusal(mesh, {folder_.path() / "p_#.ply", 24.0}, "p_2.ply");
  };
  EXPECT_TRUE(test::contains(second(test::ply(corners, {{0, 2, 1}}, true)), "its faces are not those of"));
  EXPECT_TRUE(test::contains(second(test::ply(corners, {{0, 1, 2}}, false)), "or are written differently"));
  EXPECT_TRUE(test::contains(second(test::ply({{0, 0, 0}, {1, 0, 0}}, {{0, 1, 1}}, true)), "has 2 vertices"));
  for (std::size_t size = 0; size < good.size(); ++size) second(good.substr(0, size));
  EXPECT_TRUE(test::contains(second("ply\nformat ascii 1.0\nelement face 0\nend_header\n"), "must be 'vertex'"));
  EXPECT_TRUE(test::contains(second("ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n0\n"),
                             "must have x, y and z"));
  EXPECT_TRUE(test::contains(refusal(obj_, {folder_.path() / "p_#.ply", 24.0}, "p_#.ply"), "the format of the mesh"));
}

TEST_F(DamagedVertices, TooManyVerticesInAllFrames) {
  std::string mesh;
  for (int i = 0; i < 1000; ++i) mesh += "v 0 0 0\n";
  const auto obj = folder_.write("many.obj", mesh + "f 1 2 3\n");
  const std::string header = pc2({std::vector<Eigen::Vector3f>(1000)});
  const auto with = [&](int frames) {
    return refusal(obj, {folder_.write("many.pc2", changed(header, 28, frames)), 24.0}, "many.pc2");
  };
  EXPECT_TRUE(test::contains(with(268'435), "must have 3221220032 bytes"));
  EXPECT_TRUE(test::contains(with(268'436), "kept in memory"));
}

TEST_F(DamagedVertices, OtherFormats) {
  const auto cache = folder_.write("a.pc2", pc2(triangle_frames(2)));
  for (const char* const name : {"a.glb", "a.stl", "a.fbx", "a"})
    EXPECT_TRUE(test::contains(refusal(folder_.write(name, "x"), {cache, 24.0}, name), "must be an OBJ or PLY file"));
  EXPECT_TRUE(test::contains(refusal(folder_.path() / "none.obj", {cache, 24.0}, "none.obj"), "no such file"));
  EXPECT_TRUE(test::contains(refusal(obj_, {folder_.path() / "none.pc2", 24.0}, "none.pc2"), "no such file"));
  EXPECT_TRUE(test::contains(refusal(obj_, {folder_.write("a.abc", ""), 24.0}, "a.abc"), "must be a point cache"));
  EXPECT_TRUE(test::contains(refusal(obj_, {folder_.path(), 24.0}, ""), "must be a point cache"));
}

TEST_F(DamagedVertices, MeshesThatLoseTheirNumbers) {
  // A loose edge, which is read as a mesh of its own.
  const std::vector<Eigen::Vector3f> corners = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {2, 2, 2}};
  const auto mesh = folder_.write("loose.ply", test::ply(corners, {{0, 1, 2}, {1, 3}}, false));
  Frames frames = {corners};
  const VertexFile cache{folder_.write("loose.pc2", pc2(frames)), 24.0};
  EXPECT_TRUE(test::contains(refusal(mesh, cache, "loose.ply"), "without loose vertices and edges"));
}

}  // namespace
}  // namespace esim
