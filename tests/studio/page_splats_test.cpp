#include "esim/studio/scene_view/page_splats.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "esim/scene/splats/splat_file.h"
#include "esim/studio/scene_view/first_view.h"
#include "support/temporary_directory.h"

namespace esim::studio {
namespace {

using Eigen::Vector3f;

constexpr float kHarmonic0 = 0.28209479F;

/// A splat of degree 0.
void add(Splats& splats, const Vector3f& position, const Vector3f& deviation, float opacity, float grey) {
  splats.positions.push_back(position);
  splats.deviations.push_back(deviation);
  splats.rotations.push_back(Eigen::Vector4f::UnitW());
  splats.opacities.push_back(opacity);
  for (int i = 0; i < 3; ++i) splats.harmonics.push_back((grey - 0.5F) / kHarmonic0);
}

Scene scene_of(Splats splats) {
  Scene scene;
  scene.objects.push_back({"", {}, false, std::make_shared<const Splats>(std::move(splats))});
  return scene;
}

/// What a browser reads.
Splats read(const PageSplats& page) {
  const test::TemporaryDirectory folder;
  return load_splats(folder.write("page.splat", page.bytes), [](const std::string& text) { ADD_FAILURE() << text; });
}

float grey_of(const Splats& splats) { return 0.5F + kHarmonic0 * splats.harmonics[0]; }

TEST(PageSplats, AreInTheCoordinatesOfTheObject) {
  Splats splats;
  add(splats, {1, 2, 3}, {0.1F, 0.2F, 0.3F}, 0.6F, 0.25F);
  splats.to_object = Eigen::AngleAxisd(std::numbers::pi / 2, Eigen::Vector3d::UnitZ());
  const auto pages = page_splats(scene_of(splats));
  const Splats shown = read(pages.at(0).value());
  EXPECT_LT((shown.positions[0] - Vector3f(-2, 1, 3)).norm(), 1e-6F);
  EXPECT_EQ(shown.deviations[0], Vector3f(0.1F, 0.2F, 0.3F));
  const Eigen::Quaternionf rotation(shown.rotations[0]);
  EXPECT_LT((rotation * Vector3f::UnitX() - Vector3f::UnitY()).norm(), 0.02F);
  EXPECT_NEAR(shown.opacities[0], 0.6F, 0.002F);
  EXPECT_NEAR(grey_of(shown), 0.25F, 0.002F);
  EXPECT_LT((pages[0]->box.min() - Eigen::Vector3d(-2, 1, 3)).norm(), 1e-6);
}

TEST(PageSplats, HaveDisplayColours) {
  Splats splats;
  add(splats, Vector3f::Zero(), Vector3f::Ones(), 1, 0.214F);  // linear light of the middle display colour
  splats.light = SplatLight::linear;
  EXPECT_NEAR(grey_of(read(page_splats(scene_of(splats))[0].value())), 0.5F, 0.003F);
}

TEST(PageSplats, AreTheMostVisibleIfThereAreTooMany) {
  Splats splats;
  add(splats, {0, 0, 0}, {1, 1, 0}, 0.1F, 1);
  add(splats, {1, 0, 0}, {0.1F, 0.1F, 0.1F}, 1, 1);
  add(splats, {2, 0, 0}, {0, 1, 1}, 0.9F, 1);
  Scene scene = scene_of(splats);
  scene.objects.push_back({"mesh", {}, true});
  Splats equal;
  for (int i = 0; i < 4; ++i) add(equal, {0, 0, static_cast<float>(i)}, {1, 1, 1}, 0.5F, 1);
  scene.objects.push_back({"equal", {}, true, std::make_shared<const Splats>(equal)});

  const auto all = page_splats(scene);
  EXPECT_EQ(all[0]->shown, 3U);
  EXPECT_FALSE(all[1]);
  const auto some = page_splats(scene, 3);
  EXPECT_EQ(some[0]->shown, 1U);
  EXPECT_EQ(some[0]->all, 3U);
  EXPECT_EQ(read(*some[0]).positions[0], Vector3f(2, 0, 0));
  EXPECT_EQ(some[2]->shown, 2U);
  EXPECT_EQ(some[2]->all, 4U);
}

TEST(PageSplats, OfARoomAreSeenFirstFromInside) {
  Splats splats;
  for (int i = 0; i < 1000; ++i) {
    const auto at = [&](int step) { return static_cast<float>(i * step % 100) / 100; };
    add(splats, {6 * at(7), 4 * at(11), 2.5F * at(13)}, Vector3f::Ones(), 1, 1);
  }
  add(splats, {1000, 1000, 1000}, Vector3f::Ones(), 1, 1);  // as captures have them
  const auto pages = page_splats(scene_of(splats));
  EXPECT_GT(pages[0]->box.max().x(), 999);
  const SE3 view = first_view_of_splats(pages[0]->middle);
  EXPECT_TRUE(Eigen::AlignedBox3d(Eigen::Vector3d(1, 1, 1.2), Eigen::Vector3d(3, 3, 2)).contains(view.translation));
  EXPECT_GT((view.rotation * Eigen::Vector3d::UnitZ()).x(), 0.9);
  EXPECT_LT(first_view_of_splats({Eigen::Vector3d::Zero(), Eigen::Vector3d::Ones()}).translation.x(), 0);
}

}  // namespace
}  // namespace esim::studio
