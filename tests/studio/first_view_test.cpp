#include "esim/studio/scene_view/first_view.h"

#include <gtest/gtest.h>

#include <cmath>

namespace esim::studio {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

/// The sides of a box: seen from outside, or from inside.
void add_box(Mesh& mesh, const Vector3f& low, const Vector3f& high, bool inwards) {
  const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
  for (unsigned i = 0; i < 8; ++i)
    mesh.vertices.emplace_back(i & 1 ? high.x() : low.x(), i & 2 ? high.y() : low.y(), i & 4 ? high.z() : low.z());
  constexpr std::uint32_t kOutwards[12][3] = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                                              {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  for (const auto& [a, b, c] : kOutwards) {
    if (inwards)
      mesh.triangles.push_back({first + a, first + c, first + b});
    else
      mesh.triangles.push_back({first + a, first + b, first + c});
  }
}

Vector3d axis(const SE3& view) { return view.rotation * Vector3d::UnitZ(); }

/// The largest angle between the optical axis and a corner of a box [rad].
double widest(const SE3& view, const Eigen::AlignedBox3d& box) {
  double max = 0;
  for (int i = 0; i < 8; ++i) {
    const Vector3d to = box.corner(static_cast<Eigen::AlignedBox3d::CornerType>(i)) - view.translation;
    max = std::max(max, std::acos(to.normalized().dot(axis(view))));
  }
  return max;
}

TEST(FirstView, OfAnObjectIsFromOutsideAndAbove) {
  Mesh mesh;
  add_box(mesh, {10, 20, 0}, {10.4F, 20.2F, 0.3F}, false);
  const SE3 view = first_view(still_scene(mesh));
  const Eigen::AlignedBox3d box(Vector3d(10, 20, 0), Vector3d(10.4, 20.2, 0.3));
  EXPECT_FALSE(box.contains(view.translation));
  EXPECT_GT(view.translation.z(), 0.3);
  EXPECT_LT(widest(view, box), 32.5 * M_PI / 180);  // all in sight
  EXPECT_GT(widest(view, box), 20 * M_PI / 180);    // and not small
}

TEST(FirstView, OfARoomIsFromInsideAtTheHeightOfEyes) {
  Mesh mesh;
  add_box(mesh, {0, 0, 0}, {8, 4, 2.5F}, true);
  const SE3 view = first_view(still_scene(mesh));
  EXPECT_NEAR(view.translation.z(), 1.5, 0.15);
  const Eigen::AlignedBox3d free(Vector3d(0.4, 0.4, 0), Vector3d(7.6, 3.6, 2.5));
  EXPECT_TRUE(free.contains(view.translation)) << view.translation.transpose();
  // It looks along the room, across its middle, and a little down.
  const Vector3d along = axis(view);
  EXPECT_GT(std::abs(along.x()), 0.8);
  EXPECT_LT(along.z(), 0);
  const Vector3d to_middle = Vector3d(4, 2, view.translation.z()) - view.translation;
  EXPECT_GT(to_middle.norm(), 2);
  EXPECT_GT(to_middle.normalized().dot(along), 0.95);
}

TEST(FirstView, WhatStandsInTheMiddleOfARoomDoesNotFillTheView) {
  Mesh mesh;
  add_box(mesh, {0, 0, 0}, {6, 6, 2.6F}, true);
  add_box(mesh, {2.2F, 2.2F, 0}, {3.8F, 3.8F, 2.6F}, false);  // a pillar
  const SE3 view = first_view(still_scene(mesh));
  const Vector3d& at = view.translation;
  EXPECT_TRUE(Eigen::AlignedBox3d(Vector3d(0, 0, 0), Vector3d(6, 6, 2.6)).contains(at)) << at.transpose();
  for (double way = 0; way < 2.5; way += 0.05) {
    const Vector3d seen = at + way * axis(view);
    EXPECT_FALSE(seen.x() > 2.2 && seen.x() < 3.8 && seen.y() > 2.2 && seen.y() < 3.8) << seen.transpose();
  }
}

TEST(FirstView, OfARoomWithADoorAndThickWallsIsStillFromInside) {
  Mesh mesh;
  add_box(mesh, {0, 0, -0.2F}, {5, 5, 0}, false);
  for (const auto& [low, high] :
       {std::pair(Vector3f(0, 0, 0), Vector3f(5, 0.2F, 2.5F)), std::pair(Vector3f(0, 4.8F, 0), Vector3f(5, 5, 2.5F)),
        std::pair(Vector3f(0, 0.2F, 0), Vector3f(0.2F, 4.8F, 2.5F)),
        std::pair(Vector3f(4.8F, 0.2F, 0), Vector3f(5, 3.6F, 2.5F))})
    add_box(mesh, low, high, false);
  const SE3 view = first_view(still_scene(mesh));
  const Eigen::AlignedBox3d room(Vector3d(0.2, 0.2, 0), Vector3d(4.8, 4.8, 2.5));
  EXPECT_TRUE(room.contains(view.translation)) << view.translation.transpose();
}

TEST(FirstView, OfARoomInFrontOfABackdropIsStillFromInside) {
  Mesh mesh;
  add_box(mesh, {0, 0, 0}, {5, 4, 2.5F}, true);
  add_box(mesh, {20, -30, -8}, {21, 30, 25}, false);
  const SE3 view = first_view(still_scene(mesh));
  EXPECT_TRUE(Eigen::AlignedBox3d(Vector3d(0, 0, 1.2), Vector3d(5, 4, 1.8)).contains(view.translation))
      << view.translation.transpose();
}

TEST(FirstView, LooksAtWhatStandsStillWhereAnythingDoes) {
  Mesh still, moving;
  add_box(still, {0, 0, 0}, {1, 1, 1}, false);
  add_box(moving, {100, 100, 100}, {101, 101, 101}, false);
  Scene scene;
  scene.objects = {{"still", still, false}, {"moving", moving, true}};
  const SE3 alone = first_view(still_scene(still));
  EXPECT_EQ(first_view(scene).translation, alone.translation);
  scene.objects = {{"moving", moving, true}};
  EXPECT_GT(first_view(scene).translation.x(), 50);
}

TEST(FirstView, OfNothingIsAtTheOrigin) {
  const SE3 view = first_view(Scene{});
  EXPECT_EQ(view.translation, Vector3d::Zero());
  EXPECT_NEAR(axis(view).x(), 1, 1e-12);
}

}  // namespace
}  // namespace esim::studio
