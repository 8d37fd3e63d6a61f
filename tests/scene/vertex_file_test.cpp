// Point caches and numbered meshes: which vertex of the file each vertex of the mesh follows, at which times.
#include "esim/scene/vertices/vertex_file.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "esim/core/inputs/used_files.h"
#include "esim/scene/scene_file.h"
#include "scene/loaded_vertices.h"
#include "support/errors.h"
#include "support/temporary_directory.h"

namespace esim {
namespace {

using test::Frames;
using test::kTriangle;
using test::load_with_vertices;
using test::mdd;
using test::ObjectWithVertices;
using test::pc2;
using test::TemporaryDirectory;
using test::triangle_frames;

DeformedVertices vertices_at(const SceneObject& object, double t_s) {
  DeformedVertices vertices;
  object.deformation->evaluate(to_ns(t_s), vertices);
  return vertices;
}

// --- which vertex is which -------------------------------------------------------------------------------------------

/// A random mesh with the faces of an OBJ file: polygons, materials, objects, flat and smooth shading, vertices without
/// faces, and pairs of vertices in the same place. Each corner of each face has a texture coordinate of its own.
struct RandomMesh {
  std::vector<Eigen::Vector3f> vertices;
  std::vector<std::vector<std::size_t>> faces;
  std::vector<std::size_t> vertex_of_corner;  // in the order of the faces

  explicit RandomMesh(unsigned seed) {
    std::mt19937 random(seed);
    const auto number = [&](std::size_t count) {
      return std::uniform_int_distribution<std::size_t>(0, count - 1)(random);
    };
    const auto coordinate = [&] { return std::uniform_real_distribution<float>(-2, 2)(random); };
    for (int i = 0; i < 60; ++i) vertices.emplace_back(coordinate(), coordinate(), coordinate());
    for (int i = 0; i < 20; ++i) vertices.push_back(vertices[number(60)]);  // in the same place
    for (int i = 0; i < 70; ++i) {
      std::vector<std::size_t>& face = faces.emplace_back();
      const std::size_t corners = 3 + number(3);
      // Polygons are flat and convex, so that they may be cut in any way.
      const Eigen::Vector3f middle(coordinate(), coordinate(), coordinate());
      for (std::size_t c = 0; c < corners; ++c) {
        if (corners == 3) {
          face.push_back(number(vertices.size() - 10));  // the last of these have no triangles
          continue;
        }
        const auto angle = static_cast<float>(2 * M_PI * static_cast<double>(c) / static_cast<double>(corners));
        vertices.push_back(middle + Eigen::Vector3f(std::cos(angle), std::sin(angle), 0));
        face.push_back(vertices.size() - 1);
      }
      if (face[0] == face[1] || face[1] == face[2] || face[0] == face[2]) face = {0, 1, 2};
    }
    for (const auto& face : faces) vertex_of_corner.insert(vertex_of_corner.end(), face.begin(), face.end());
  }

  std::string obj(bool normals) const {
    std::string text = "mtllib none.mtl\n", of_faces;
    for (std::size_t i = 0; i < vertices.size(); ++i)
      text += test::obj_vertex(vertices[i]) + (i % 7 == 0 ? "# a comment\n" : "");
    std::size_t corner = 0;
    for (std::size_t f = 0; f < faces.size(); ++f) {
      if (f % 11 == 0) of_faces += "o object" + std::to_string(f) + "\n";
      if (f % 5 == 0) of_faces += "usemtl material" + std::to_string(f % 3) + "\n";
      if (normals) text += "vn 0 " + std::to_string(f % 2) + " 1\n";
      of_faces += "f";
      for (const std::size_t vertex : faces[f]) {
        text += "vt " + std::to_string(static_cast<double>(corner++) / 1024) + " 0.5\n";
        // Numbers from 1, or from -1 backwards.
        const long written =
            f % 4 == 3 ? static_cast<long>(vertex) - static_cast<long>(vertices.size()) : static_cast<long>(vertex) + 1;
        of_faces += (f % 6 == 5 ? " \\\n " : " ") + std::to_string(written) + "/" + std::to_string(corner) +
                    (normals ? "/" + std::to_string(f + 1) : "");
      }
      of_faces += "\n";
    }
    return text + of_faces;
  }

  /// Positions that tell which vertex is there.
  Frames frames() const {
    Frames result = {vertices, {}};
    for (std::size_t i = 0; i < vertices.size(); ++i) {
      const auto number = static_cast<float>(i);
      result[1].emplace_back(number, number * number, -number);
    }
    return result;
  }
};

TEST(VertexFile, VerticesOfAnObjKeepTheirNumbers) {
  const TemporaryDirectory folder;
  for (unsigned seed = 0; seed < 20; ++seed) {
    const RandomMesh mesh(seed);
    const auto obj = folder.write("mesh.obj", mesh.obj(seed % 2 == 0));
    const ObjectWithVertices loaded = load_with_vertices(obj, {folder.write("mesh.pc2", pc2(mesh.frames())), 1.0});
    const DeformedVertices at = vertices_at(loaded.object, 1);
    std::size_t triangles = 0;
    for (const auto& face : mesh.faces) triangles += face.size() - 2;
    ASSERT_EQ(loaded.object.mesh.triangles.size(), triangles);
    for (std::size_t i = 0; i < triangles; ++i) {
      for (std::size_t c = 0; c < 3; ++c) {
        const auto corner =
            static_cast<std::size_t>(std::lround(1024 * double{loaded.object.mesh.texture_uv[i][c].x()}));
        const auto number = static_cast<float>(mesh.vertex_of_corner.at(corner));
        const Eigen::Vector3f there = at.positions[loaded.object.mesh.triangles[i][c]];
        EXPECT_LT((there - Eigen::Vector3f(number, number * number, -number)).norm(), 0.01F) << corner;
      }
    }
  }
}

TEST(VertexFile, ObjHasTheSameLookAsWithoutVertices) {
  const TemporaryDirectory folder;
  const RandomMesh random(3);
  const auto obj = folder.write("mesh.obj", random.obj(true));
  folder.write("none.mtl",
               "newmtl material0\nKd 0.1 0.1 0.1\nnewmtl material1\nKd 0.7 0.7 0.7\nnewmtl material2\nKe 1 1 1\n");
  const Mesh with = load_with_vertices(obj, {folder.write("mesh.pc2", pc2(random.frames())), 1.0}).object.mesh;
  const Mesh without = load_mesh(obj, [](const std::string&) {});
  ASSERT_EQ(with.triangles.size(), without.triangles.size());
  EXPECT_EQ(with.material, without.material);
  EXPECT_EQ(with.texture_uv, without.texture_uv);
  ASSERT_EQ(with.materials.size(), without.materials.size());
  for (std::size_t i = 0; i < with.materials.size(); ++i) EXPECT_EQ(with.materials[i].base, without.materials[i].base);
  for (std::size_t i = 0; i < with.triangles.size(); ++i) {
    for (std::size_t c = 0; c < 3; ++c) {
      // Numbers are rounded differently.
      EXPECT_LT((with.vertices[with.triangles[i][c]] - without.vertices[without.triangles[i][c]]).norm(), 1e-6F);
    }
  }
}

TEST(VertexFile, VerticesOfAPlyKeepTheirNumbers) {
  const TemporaryDirectory folder;
  for (const bool binary : {false, true}) {
    RandomMesh mesh(5);
    const auto ply = folder.write("mesh.ply", test::ply(mesh.vertices, mesh.faces, binary));
    const ObjectWithVertices loaded = load_with_vertices(ply, {folder.write("mesh.mdd", mdd(mesh.frames(), {0, 1}))});
    const DeformedVertices at = vertices_at(loaded.object, 1);
    std::size_t triangle = 0;
    for (const auto& face : mesh.faces) {
      for (std::size_t i = 0; i + 2 < face.size(); ++i, ++triangle) {
        for (const std::uint32_t corner : loaded.object.mesh.triangles.at(triangle)) {
          const auto number = static_cast<std::size_t>(std::lround(double{at.positions[corner].x()}));
          EXPECT_NE(std::find(face.begin(), face.end(), number), face.end()) << triangle;
        }
      }
    }
    EXPECT_EQ(triangle, loaded.object.mesh.triangles.size());
  }
}

TEST(VertexFile, VerticesInOnePlaceMayMoveApart) {
  const TemporaryDirectory folder;
  const std::string seam =
      "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 1 0 0\nv 2 0 0\nv 2 1 0\nv 1 1 0\nf 1 2 3 4\nf 5 6 7 8\n";
  Frames frames = {{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {1, 0, 0}, {2, 0, 0}, {2, 1, 0}, {1, 1, 0}}, {}};
  for (std::size_t i = 0; i < 8; ++i)
    frames[1].push_back(frames[0][i] + (i < 4 ? Eigen::Vector3f(-1, 0, 0) : Eigen::Vector3f(1, 0, 0)));
  const ObjectWithVertices loaded =
      load_with_vertices(folder.write("seam.obj", seam), {folder.write("seam.pc2", pc2(frames)), 1.0});
  const DeformedVertices at = vertices_at(loaded.object, 1);
  ASSERT_EQ(loaded.object.mesh.triangles.size(), 4U);
  for (std::size_t i = 0; i < 4; ++i) {
    for (const std::uint32_t corner : loaded.object.mesh.triangles[i]) {
      if (i < 2) {
        EXPECT_LE(at.positions[corner].x(), 0) << i;
      } else {
        EXPECT_GE(at.positions[corner].x(), 2) << i;
      }
    }
  }
}

TEST(VertexFile, SeamsOfTexturesAndCloseVerticesJoinOnlyWhatIsOneVertex) {
  const TemporaryDirectory folder;
  // Two triangles with texture coordinates of their own, and a third one with a vertex 1e-6 away.
  const auto obj = folder.write("a.obj",
                                "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nv 1 0.000001 0\nvt 0 0\nvt 1 1\nf 1/1 2/1 3/1\nf "
                                "2/2 4/2 3/2\nf 5/1 4/1 3/1\n");
  Frames frames = {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}, {1, 1e-6F, 0}}};
  const ObjectWithVertices loaded = load_with_vertices(obj, {folder.write("a.pc2", pc2(frames)), 24.0});
  EXPECT_EQ(loaded.object.mesh.vertices.size(), 5U);
}

TEST(VertexFile, MayHaveManyVertices) {
  const TemporaryDirectory folder;
  std::string obj;
  Frames frames(1);
  for (int i = 0; i < 140'000; ++i) {
    frames[0].emplace_back(i % 3, i % 5, i % 7);
    obj += test::obj_vertex(frames[0].back());
  }
  const Eigen::Vector3f expected[] = {{1, 2, 3}, {4, 5, 6}, {7, 8, 9}};
  const std::size_t numbers[] = {3, 65'535 + 3, 139'999};
  obj += "f";
  for (std::size_t i = 0; i < 3; ++i) obj += " " + std::to_string(numbers[i] + 1);
  frames.push_back(frames[0]);
  for (std::size_t i = 0; i < 3; ++i) frames[1][numbers[i]] = expected[i];
  const SceneObject object =
      load_with_vertices(folder.write("a.obj", obj + "\n"), {folder.write("a.pc2", pc2(frames)), 1.0}).object;
  const DeformedVertices at = vertices_at(object, 1);
  ASSERT_EQ(object.mesh.triangles.size(), 1U);
  for (std::size_t i = 0; i < 3; ++i)
    EXPECT_LT((at.positions[object.mesh.triangles[0][i]] - expected[i]).norm(), 1e-6F);
}

// --- times and axes --------------------------------------------------------------------------------------------------

TEST(VertexFile, HasTheTimesOfItsFrames) {
  const TemporaryDirectory folder;
  const auto obj = folder.write("a.obj", kTriangle);
  const Frames frames = triangle_frames(5);
  const SceneObject cached = load_with_vertices(obj, {folder.write("a.pc2", pc2(frames, 101, 0.5F)), 8.0}).object;
  EXPECT_EQ(cached.deformation->span().start, 0);
  EXPECT_EQ(cached.deformation->span().end, to_ns(4 * 0.5 / 8));
  EXPECT_NEAR(vertices_at(cached, 3 * 0.5 / 8).positions[2].z(), 9, 1e-5);
  EXPECT_NEAR(vertices_at(cached, 3 * 0.5 / 8).velocities[2].z(), 6 * 16, 1e-3);
  EXPECT_NEAR(cached.mesh.vertices[1].z(), 0, 1e-6);

  const SceneObject timed =
      load_with_vertices(obj, {folder.write("a.mdd", mdd(frames, {1, 1.5F, 1.75F, 3, 4}))}).object;
  EXPECT_EQ(timed.deformation->span().start, to_ns(1));
  EXPECT_EQ(timed.deformation->span().end, to_ns(4));
  EXPECT_NEAR(vertices_at(timed, 1.75).positions[1].z(), 4, 1e-5);

  for (std::size_t i = 0; i < frames.size(); ++i) {  // 8, 9, 10, 11, 12
    std::string text;
    for (const Eigen::Vector3f& vertex : frames[i]) text += test::obj_vertex(vertex);
    folder.write("n_" + std::to_string(8 + i) + ".obj", text + "f 1 2 3\n");
  }
  const SceneObject numbered = load_with_vertices(obj, {folder.path() / "n_#.obj", 10.0}).object;
  EXPECT_EQ(numbered.deformation->span().end, to_ns(0.4));
  EXPECT_NEAR(vertices_at(numbered, 0.3).positions[2].z(), 9, 1e-5);
}

TEST(VertexFile, MayHaveASingleFrame) {
  const TemporaryDirectory folder;
  Frames frames = triangle_frames(3);
  frames.erase(frames.begin(), frames.begin() + 2);
  const SceneObject object =
      load_with_vertices(folder.write("a.obj", kTriangle), {folder.write("a.pc2", pc2(frames)), 24.0}).object;
  EXPECT_EQ(object.deformation->span().end, object.deformation->span().start);
  EXPECT_EQ(object.mesh.vertices[1].z(), 4);
  EXPECT_EQ(vertices_at(object, 3).positions[2].z(), 4);
  EXPECT_EQ(vertices_at(object, 0).velocities[2].z(), 0);
}

TEST(VertexFile, AxesAreConverted) {
  const TemporaryDirectory folder;
  const auto obj = folder.write("a.obj", "v 1 2 3\nv 4 5 7\nv 0 1 0\nf 1 2 3\n");
  const Frames same = {{{1, 2, 3}, {4, 5, 7}, {0, 1, 0}}}, y_up = {{{1, 3, -2}, {4, 7, -5}, {0, 0, -1}}},
               left = {{{1, 3, 2}, {4, 7, 5}, {0, 0, 1}}};
  const std::vector<std::pair<VertexAxes, Frames>> cases = {
      {VertexAxes::same, same}, {VertexAxes::y_up, y_up}, {VertexAxes::left_handed, left}};
  const char* const names[] = {"same", "y_up", "left_handed"};
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t k = 0; k < 3; ++k) {
      const ObjectWithVertices loaded =
          load_with_vertices(obj, {folder.write("a.pc2", pc2(cases[i].second)), 24.0, cases[k].first});
      if (i == k) {
        EXPECT_EQ(loaded.object.mesh.vertices[0], same[0][0]);
        EXPECT_EQ(loaded.warnings, std::vector<std::string>());
      } else {
        ASSERT_EQ(loaded.warnings.size(), 1U);
        EXPECT_TRUE(test::contains(loaded.warnings[0], std::string("only if axes is ") + names[i]));
      }
    }
  }
}

TEST(VertexFile, AllFilesAreNoted) {
  const TemporaryDirectory folder;
  std::vector<std::string> used;
  const UsedFilesListener listener([&](const UsedFile& file) { used.push_back(file.path.filename().string()); });
  for (const char* const name : {"a_01.obj", "a_02.obj"}) folder.write(name, kTriangle);
  load_with_vertices(folder.write("a.obj", kTriangle), {folder.path() / "a_##.obj", 24.0});
  load_with_vertices(folder.write("b.obj", kTriangle), {folder.write("b.pc2", pc2(triangle_frames(2))), 24.0});
  load_with_vertices(folder.write("c.obj", kTriangle), {folder.write("c.mdd", mdd(triangle_frames(2), {0, 1}))});
  for (const char* const name : {"a.obj", "a_01.obj", "a_02.obj", "b.obj", "b.pc2", "c.mdd"})
    EXPECT_NE(std::find(used.begin(), used.end(), name), used.end()) << name;
}

}  // namespace
}  // namespace esim
