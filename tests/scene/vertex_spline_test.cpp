// The splines through frames of vertices, the deformation that follows them, and its normals.
#include "esim/scene/deformation/vertex_spline.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <numeric>
#include <random>

#include "esim/core/error.h"
#include "esim/scene/deformation/cached_deformation.h"
#include "support/errors.h"
#include "support/numeric.h"

namespace esim {
namespace {

using Random = std::mt19937;

double uniform(Random& random, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(random);
}

/// Times with steps between 0.02 and 0.2 s.
std::vector<double> some_times(Random& random, std::size_t count) {
  std::vector<double> times_s = {uniform(random, -5, 5)};
  while (times_s.size() < count) times_s.push_back(times_s.back() + uniform(random, 0.02, 0.2));
  return times_s;
}

VertexFrames random_frames(Random& random, std::size_t frames, std::size_t vertices, double size) {
  VertexFrames result{some_times(random, frames), {}};
  for (std::size_t i = 0; i < frames * vertices; ++i)
    result.positions.push_back(
        Eigen::Vector3d::NullaryExpr([&] { return uniform(random, -size, size); }).cast<float>());
  return result;
}

CachedDeformation deformation_of(VertexFrames frames) {
  std::vector<std::uint32_t> numbers(frames.vertices_per_frame());
  std::iota(numbers.begin(), numbers.end(), 0U);
  return {VertexSpline(std::move(frames)), numbers, ShadingNormals(Mesh{})};
}

/// Positions and velocities of all vertices along a spline.
DeformedVertices vertices_at(const VertexSpline& spline, double t_s) {
  const VertexSpline::Place place = spline.place_at(t_s);
  DeformedVertices at;
  for (std::size_t i = 0; i < spline.vertices(); ++i) {
    Eigen::Vector3f position = spline.control_points(place.first)[i], velocity = Eigen::Vector3f::Zero();
    for (std::size_t k = 0; k < spline.degree(); ++k) {
      const Eigen::Vector3f step =
          spline.control_points(place.first + k + 1)[i] - spline.control_points(place.first + k)[i];
      position += place.steps[k] * step, velocity += place.slopes[k] * step;
    }
    at.positions.push_back(position), at.velocities.push_back(velocity);
  }
  return at;
}

/// A cubic spline from its definition: per interval a cubic that begins at 0, all coefficients by one dense system.
class SlowSpline {
 public:
  SlowSpline(std::vector<double> times_s, const Eigen::VectorXd& values) : times_s_(std::move(times_s)) {
    const auto intervals = static_cast<Eigen::Index>(times_s_.size()) - 1;
    Eigen::MatrixXd A = Eigen::MatrixXd::Zero(4 * intervals, 4 * intervals);
    Eigen::VectorXd b = Eigen::VectorXd::Zero(4 * intervals);
    Eigen::Index row = 0;
    for (Eigen::Index i = 0; i < intervals; ++i) {
      const double h = step(i);
      A.block<1, 4>(row, 4 * i) << 1, 0, 0, 0;
      b[row++] = values[i];
      A.block<1, 4>(row, 4 * i) << 1, h, h * h, h * h * h;
      b[row++] = values[i + 1];
      if (i + 1 == intervals) break;
      A.block<1, 8>(row++, 4 * i) << 0, 1, 2 * h, 3 * h * h, 0, -1, 0, 0;
      A.block<1, 8>(row++, 4 * i) << 0, 0, 2, 6 * h, 0, 0, -2, 0;
    }
    for (const Eigen::Index i : {Eigen::Index{0}, intervals - 2})  // not a knot: the third derivative is continuous
      A.block<1, 8>(row++, 4 * i) << 0, 0, 0, 1, 0, 0, 0, -1;
    coefficients_ = A.fullPivLu().solve(b);
  }

  std::pair<double, double> at(double t_s) const {
    Eigen::Index i = 0;
    while (i + 2 < static_cast<Eigen::Index>(times_s_.size()) && t_s > times_s_[static_cast<std::size_t>(i) + 1]) ++i;
    const Eigen::Vector4d c = coefficients_.segment<4>(4 * i);
    const double s = t_s - times_s_[static_cast<std::size_t>(i)];
    return {c[0] + s * (c[1] + s * (c[2] + s * c[3])), c[1] + s * (2 * c[2] + s * 3 * c[3])};
  }

 private:
  double step(Eigen::Index i) const {
    return times_s_[static_cast<std::size_t>(i) + 1] - times_s_[static_cast<std::size_t>(i)];
  }

  std::vector<double> times_s_;
  Eigen::VectorXd coefficients_;
};

TEST(VertexSpline, GoesThroughTheFrames) {
  Random random(1);
  for (std::size_t frames = 1; frames < 40; ++frames) {
    const VertexFrames given = random_frames(random, frames, 30, 1);
    const VertexSpline spline(given);
    EXPECT_EQ(spline.size(), frames);
    for (std::size_t i = 0; i < frames; ++i) {
      const DeformedVertices at = vertices_at(spline, given.times_s[i]);
      for (std::size_t k = 0; k < 30; ++k)
        EXPECT_LT((at.positions[k] - given.positions[30 * i + k]).norm(), 2e-5F) << frames << " frames, frame " << i;
    }
  }
}

TEST(VertexSpline, IsTheSplineWithoutKnotsNextToTheEnds) {
  Random random(2);
  for (const std::size_t frames : {4U, 5U, 6U, 7U, 12U, 25U}) {
    const VertexFrames given = random_frames(random, frames, 1, 1);
    const VertexSpline spline(given);
    Eigen::VectorXd values(static_cast<Eigen::Index>(frames));
    for (std::size_t i = 0; i < frames; ++i) values[static_cast<Eigen::Index>(i)] = double{given.positions[i].y()};
    if (frames == 4) continue;  // both conditions are the same; see ReproducesCubics
    const SlowSpline slow(given.times_s, values);
    for (int trial = 0; trial < 200; ++trial) {
      const double t_s = uniform(random, spline.start_s(), spline.end_s());
      const DeformedVertices at = vertices_at(spline, t_s);
      const auto [position, velocity] = slow.at(t_s);
      // Single precision of control points of about 10, and their differences per 0.02 s.
      EXPECT_NEAR(double{at.positions[0].y()}, position, 1e-5) << frames;
      EXPECT_NEAR(double{at.velocities[0].y()}, velocity, 1e-3) << frames;
    }
  }
}

TEST(VertexSpline, ReproducesCubics) {
  Random random(3);
  for (std::size_t frames = 1; frames < 12; ++frames) {
    VertexFrames given{some_times(random, frames), {}};
    const double middle_s = given.times_s[frames / 2];
    Eigen::Vector4d c = Eigen::Vector4d::NullaryExpr([&] { return uniform(random, -1, 1); });
    c.tail(std::max<Eigen::Index>(0, 4 - static_cast<Eigen::Index>(frames))).setZero();
    const auto cubic = [&](double t_s) {
      const double s = t_s - middle_s;
      return c[0] + s * (c[1] + s * (c[2] + s * c[3]));
    };
    for (const double t_s : given.times_s) given.positions.emplace_back(0, 0, static_cast<float>(cubic(t_s)));
    const VertexSpline spline(given);
    for (int trial = 0; trial < 50; ++trial) {
      const double t_s = uniform(random, spline.start_s(), spline.end_s()), s = t_s - middle_s;
      const DeformedVertices at = vertices_at(spline, t_s);
      EXPECT_NEAR(double{at.positions[0].z()}, cubic(t_s), 2e-6) << frames;
      EXPECT_NEAR(double{at.velocities[0].z()}, c[1] + s * (2 * c[2] + s * 3 * c[3]), 2e-4) << frames;
    }
  }
}

TEST(VertexSpline, VerticesThatRestDoNotMoveAtAll) {
  Random random(4);
  VertexFrames given = random_frames(random, 20, 2, 1);
  for (std::size_t i = 0; i < 20; ++i) given.positions[2 * i] = {123.456F, -0.1F, 7e-3F};
  const VertexSpline spline(given);
  for (int trial = 0; trial < 100; ++trial) {
    const DeformedVertices at = vertices_at(spline, uniform(random, spline.start_s(), spline.end_s()));
    EXPECT_EQ(at.positions[0], given.positions[0]);
    EXPECT_EQ(at.velocities[0], Eigen::Vector3f::Zero());
  }
}

TEST(VertexSpline, MayHaveManyFrames) {
  constexpr std::size_t kFrames = 100'000, kVertices = 30;
  VertexFrames given;
  for (std::size_t i = 0; i < kFrames; ++i) {
    given.times_s.push_back(static_cast<double>(i) / 1000);
    for (std::size_t k = 0; k < kVertices; ++k)
      given.positions.emplace_back(static_cast<float>(i % (k + 2)), static_cast<float>(k), 1);
  }
  const VertexSpline spline(given);
  for (std::size_t i = 0; i < kFrames; i += 997) {
    const DeformedVertices at = vertices_at(spline, given.times_s[i]);
    for (std::size_t k = 0; k < kVertices; ++k)
      EXPECT_LT((at.positions[k] - given.positions[kVertices * i + k]).norm(), 1e-4F) << i << ", " << k;
  }
}

TEST(VertexSpline, VerySteepOnesAreRefused) {
  const VertexFrames given{{0, 1e-6, 1, 2, 3}, {{0, 0, 0}, {1e9F, 0, 0}, {-1e9F, 0, 0}, {1e9F, 0, 0}, {0, 0, 0}}};
  EXPECT_TRUE(test::contains(test::message_of<UserError>([&] { VertexSpline{given}; }), "equal steps of time"));
}

TEST(CachedDeformation, VelocitiesAreTheDerivativeOfPositions) {
  Random random(5);
  // A smooth motion, so that the differences are those of rounding.
  VertexFrames given;
  for (int i = 0; i < 60; ++i) {
    given.times_s.push_back(i / 24.0);
    for (int k = 0; k < 5; ++k)
      given.positions.emplace_back(std::sin(0.3F * static_cast<float>(i + k)), std::cos(0.2F * static_cast<float>(i)),
                                   0);
  }
  const CachedDeformation deformation = deformation_of(given);
  for (int trial = 0; trial < 200; ++trial) {
    const double t_s = uniform(random, 0.05, 2.4);
    DeformedVertices at;
    deformation.evaluate(to_ns(t_s), at);
    for (std::size_t k = 0; k < 5; ++k) {
      const auto position = [&](double s) {
        DeformedVertices there;
        deformation.evaluate(to_ns(s), there);
        return Eigen::Vector3d(there.positions[k].cast<double>());
      };
      // Positions are rounded by 1e-7 in steps of 1e-2 s, and a fifth of a frame is a part of one or two cubics.
      EXPECT_LT(
          test::largest_difference(at.velocities[k].cast<double>(), test::numeric_derivative(position, t_s, 4e-3)),
          2e-3)
          << t_s;
    }
  }
}

TEST(CachedDeformation, RestsBeforeAndAfterItsFrames) {
  Random random(6);
  const VertexFrames given = random_frames(random, 9, 4, 1);
  const CachedDeformation deformation = deformation_of(given);
  const TimeSpan span = deformation.span();
  EXPECT_EQ(span.start, to_ns(given.times_s.front()));
  EXPECT_EQ(span.end, to_ns(given.times_s.back()));
  for (const TimeNs beyond : {TimeNs{0}, TimeNs{1}, kNsPerSecond, 1000 * kNsPerSecond}) {
    DeformedVertices before, after;
    deformation.evaluate(span.start - 1 - beyond, before);
    deformation.evaluate(span.end + beyond, after);
    for (std::size_t k = 0; k < 4; ++k) {
      EXPECT_LT((before.positions[k] - given.positions[k]).norm(), 1e-5F);
      EXPECT_LT((after.positions[k] - given.positions[8 * 4 + k]).norm(), 1e-5F);
      EXPECT_EQ(before.velocities[k], Eigen::Vector3f::Zero());
      EXPECT_EQ(after.velocities[k], Eigen::Vector3f::Zero());
    }
  }
  DeformedVertices moving;
  deformation.evaluate(span.start, moving);
  EXPECT_GT(moving.velocities[0].norm(), 0);
}

TEST(CachedDeformation, BoundsContainAllVerticesAtAllTimes) {
  Random random(7);
  int beyond_frames = 0;
  for (int trial = 0; trial < 300; ++trial) {
    const auto frames = static_cast<std::size_t>(uniform(random, 1, 30));
    const double size = std::pow(10, uniform(random, -6, 8));
    VertexFrames given = random_frames(random, frames, 6, size);
    const auto offset = Eigen::Vector3f::Constant(static_cast<float>(uniform(random, -1, 1) * 100 * size));
    Eigen::AlignedBox3f of_frames;
    for (Eigen::Vector3f& position : given.positions) of_frames.extend(position += offset);
    const CachedDeformation deformation = deformation_of(given);
    const TimeSpan span = deformation.span();
    for (int look = 0; look < 100; ++look) {
      const TimeNs t = to_ns(uniform(random, to_seconds(span.start) - 0.1, to_seconds(span.end) + 0.1));
      DeformedVertices at;
      deformation.evaluate(t, at);
      const Eigen::AlignedBox3f box = deformation.bounds(t);
      for (const Eigen::Vector3f& position : at.positions) {
        EXPECT_TRUE(box.contains(position)) << position.transpose() << " at " << t;
        if (!of_frames.contains(position)) ++beyond_frames;
      }
    }
  }
  EXPECT_GT(beyond_frames, 1000);  // so that the box of the frames would not do
}

TEST(CachedDeformation, BoundsReachNoFurtherThanThreeFrames) {
  VertexFrames given;
  for (int i = 0; i < 30; ++i) {
    given.times_s.push_back(i / 24.0);
    for (const float x : {0.0F, 1.0F}) given.positions.emplace_back(x + static_cast<float>(i) / 24, 0, 0);  // 1 m/s
  }
  const CachedDeformation deformation = deformation_of(given);
  for (TimeNs t = 0; t < kNsPerSecond; t += 7 * kNsPerMs) {
    const Eigen::AlignedBox3f box = deformation.bounds(t);
    const auto moved = static_cast<float>(to_seconds(t));
    EXPECT_GT(box.min().x(), moved - 3.01F / 24) << t;
    EXPECT_LT(box.max().x(), moved + 1 + 3.01F / 24) << t;
  }
}

// --- normals ---------------------------------------------------------------------------------------------------------

/// A sphere of quadrilaterals, whose normals are those of a sphere.
Mesh sphere(int rings, bool other_diagonals = false) {
  Mesh mesh;
  const int around = 2 * rings;
  for (int j = 0; j <= rings; ++j) {
    for (int i = 0; i < around; ++i) {
      const double a = M_PI * j / rings, b = 2 * M_PI * i / around, radius = j < rings ? std::sin(a) : 0;
      mesh.vertices.push_back(Eigen::Vector3d(radius * std::cos(b), radius * std::sin(b), std::cos(a)).cast<float>());
      mesh.normals.push_back(mesh.vertices.back().normalized());
    }
  }
  const auto index = [&](int j, int i) { return static_cast<std::uint32_t>(j * around + i % around); };
  for (int j = 0; j < rings; ++j) {
    for (int i = 0; i < around; ++i) {
      const std::uint32_t a = index(j, i), b = index(j + 1, i), c = index(j + 1, i + 1), d = index(j, i + 1);
      if (other_diagonals) {
        mesh.triangles.push_back({a, b, d}), mesh.triangles.push_back({b, c, d});
      } else {
        mesh.triangles.push_back({a, b, c}), mesh.triangles.push_back({a, c, d});
      }
    }
  }
  return mesh;
}

/// The definition, in double precision, for one vertex after the other.
Eigen::Vector3d slow_normal(const Mesh& mesh, const std::vector<Eigen::Vector3f>& positions, std::size_t vertex) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero(), rest = Eigen::Vector3d::Zero();
  for (const auto& triangle : mesh.triangles) {
    for (std::size_t i = 0; i < 3; ++i) {
      if (mesh.vertices[triangle[i]] != mesh.vertices[vertex] || mesh.normals[triangle[i]] != mesh.normals[vertex])
        continue;
      const auto normal_in = [&](const std::vector<Eigen::Vector3f>& at) -> Eigen::Vector3d {
        const Eigen::Vector3d a = at[triangle[i]].cast<double>();
        const Eigen::Vector3d b = at[triangle[(i + 1) % 3]].cast<double>() - a,
                              c = at[triangle[(i + 2) % 3]].cast<double>() - a;
        if (b.cross(c).norm() <= 2e-6 * std::max({b.squaredNorm(), c.squaredNorm(), (b - c).squaredNorm()}))
          return Eigen::Vector3d::Zero();
        return b.cross(c).normalized() * std::atan2(b.cross(c).norm(), b.dot(c));
      };
      sum += normal_in(positions), rest += normal_in(mesh.vertices);
    }
  }
  return std::copysign(1.0, rest.dot(mesh.normals[vertex].cast<double>())) * sum.normalized();
}

std::vector<Eigen::Vector3f> bent(const std::vector<Eigen::Vector3f>& vertices) {
  std::vector<Eigen::Vector3f> result;
  for (const Eigen::Vector3f& v : vertices)
    result.emplace_back(2 * v.x(), v.y() + 0.3F * std::sin(2 * v.z()), v.z() - 0.2F * v.x() * v.x());
  return result;
}

TEST(ShadingNormals, AreMeansByAngle) {
  for (const float side : {1.0F, -1.0F}) {  // outwards, inwards
    Mesh mesh = sphere(8);
    for (Eigen::Vector3f& normal : mesh.normals) normal *= side;
    const std::vector<Eigen::Vector3f> moved = bent(mesh.vertices);
    std::vector<Eigen::Vector3f> normals;
    ShadingNormals(mesh).evaluate(moved, normals);
    ASSERT_EQ(normals.size(), mesh.vertices.size());
    for (std::size_t i = 0; i < normals.size(); ++i)
      EXPECT_LT(test::largest_difference(normals[i].cast<double>(), slow_normal(mesh, moved, i)), 1e-5) << i;
  }
}

TEST(ShadingNormals, AreSmoothAcrossSplitVertices) {
  // As files with texture coordinates have them: every triangle has vertices of its own.
  const Mesh shared = sphere(8);
  Mesh split;
  for (const auto& triangle : shared.triangles) {
    for (const std::uint32_t corner : triangle) {
      split.vertices.push_back(shared.vertices[corner]), split.normals.push_back(shared.normals[corner]);
    }
    const auto n = static_cast<std::uint32_t>(split.vertices.size());
    split.triangles.push_back({n - 3, n - 2, n - 1});
  }
  std::vector<Eigen::Vector3f> of_shared, of_split;
  ShadingNormals(shared).evaluate(bent(shared.vertices), of_shared);
  ShadingNormals(split).evaluate(bent(split.vertices), of_split);
  for (std::size_t i = 0; i < split.triangles.size(); ++i) {
    for (std::size_t c = 0; c < 3; ++c)
      EXPECT_LT((of_split[3 * i + c] - of_shared[shared.triangles[i][c]]).norm(), 1e-5F);
  }
}

TEST(ShadingNormals, OfFlatFacesStayFlat) {
  Mesh flat = sphere(4);
  Mesh faceted;
  for (const auto& [a, b, c] : flat.triangles) {
    const Eigen::Vector3f corners[] = {flat.vertices[a], flat.vertices[b], flat.vertices[c]};
    const Eigen::Vector3f normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
    if (normal.norm() < 1e-6F) continue;
    for (const Eigen::Vector3f& corner : corners)
      faceted.vertices.push_back(corner), faceted.normals.push_back(normal.normalized());
    const auto n = static_cast<std::uint32_t>(faceted.vertices.size());
    faceted.triangles.push_back({n - 3, n - 2, n - 1});
  }
  const std::vector<Eigen::Vector3f> moved = bent(faceted.vertices);
  std::vector<Eigen::Vector3f> normals;
  ShadingNormals(faceted).evaluate(moved, normals);
  for (std::size_t i = 0; i < normals.size(); i += 3) {
    const Eigen::Vector3f expected = (moved[i + 1] - moved[i]).cross(moved[i + 2] - moved[i]).normalized();
    for (std::size_t c = 0; c < 3; ++c) EXPECT_LT((normals[i + c] - expected).norm(), 1e-5F) << i;
  }
}

TEST(ShadingNormals, HardlyDependOnHowFacesAreCut) {
  Mesh one = sphere(24), other = sphere(24, true);
  std::vector<Eigen::Vector3f> first, second;
  ShadingNormals(one).evaluate(one.vertices, first);
  ShadingNormals(other).evaluate(other.vertices, second);
  for (std::size_t i = 0; i < first.size(); ++i) EXPECT_LT((first[i] - second[i]).norm(), 2e-5F) << i;
}

TEST(ShadingNormals, AreZeroWithoutNormalsOrArea) {
  Mesh mesh;
  mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {5, 5, 5}};
  mesh.triangles = {{0, 1, 2}};
  std::vector<Eigen::Vector3f> normals = {{1, 2, 3}};
  ShadingNormals(mesh).evaluate(mesh.vertices, normals);
  EXPECT_TRUE(normals.empty());
  mesh.normals = {{0, 0, 1}, {0, 0, 0}, {0, 0, -1}, {1, 0, 0}};
  ShadingNormals(mesh).evaluate(mesh.vertices, normals);
  EXPECT_EQ(normals, (std::vector<Eigen::Vector3f>{{0, 0, 1}, {0, 0, 0}, {0, 0, -1}, {0, 0, 0}}));
  ShadingNormals(mesh).evaluate({{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {0, 0, 0}}, normals);
  EXPECT_EQ(normals, std::vector<Eigen::Vector3f>(4, Eigen::Vector3f::Zero()));
}

}  // namespace
}  // namespace esim
