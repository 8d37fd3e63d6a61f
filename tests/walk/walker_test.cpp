#include "esim/walk/walker.h"

#include <gtest/gtest.h>

#include <numbers>

#include "esim/core/error.h"
#include "support/errors.h"

namespace esim {
namespace {

using Effect = Walker::Effect;
using Eigen::Vector3d;

constexpr double kDegree = std::numbers::pi / 180.0;

/// Level, looking along world x.
SE3 along_x(const Vector3d& position) {
  Eigen::Matrix3d R;
  R.col(0) = -Vector3d::UnitY(), R.col(1) = -Vector3d::UnitZ(), R.col(2) = Vector3d::UnitX();
  return {Eigen::Quaterniond(R), position};
}

Effect press(Walker& walker, std::string_view keys) {
  Effect last = Effect::nothing;
  for (const Key key : keys_of(keys)) last = walker.press(key);
  return last;
}

Vector3d place(const Walker& walker) { return walker.T_world_camera().translation; }
Vector3d gaze(const Walker& walker) { return walker.T_world_camera().rotation * Vector3d::UnitZ(); }

TEST(Walker, BeginsWhereItIsPut) {
  const SE3 start = along_x({1, 2, 3});
  const Walker walker(start);
  EXPECT_LT((place(walker) - start.translation).norm(), 1e-12);
  EXPECT_LT(walker.T_world_camera().rotation.angularDistance(start.rotation), 1e-7);

  SE3 rolled = start;
  rolled.rotation = Eigen::Quaterniond(Eigen::AngleAxisd(0.7, Vector3d::UnitX())) * start.rotation;
  EXPECT_LT(Walker(rolled).T_world_camera().rotation.angularDistance(start.rotation), 1e-7) << "without roll";

  SE3 down{Eigen::Quaterniond(Eigen::AngleAxisd(std::numbers::pi, Vector3d::UnitX())), {0, 0, 5}};
  EXPECT_NEAR(Walker(down).yaw_rad(), std::numbers::pi / 2, 1e-9) << "up in the image is y";
  EXPECT_NEAR(Walker(down).pitch_rad(), -89 * kDegree, 1e-9);
}

TEST(Walker, StepsAlongItsHeading) {
  Walker walker(along_x(Vector3d::Zero()), 2.0);
  EXPECT_EQ(press(walker, "w"), Effect::moved);
  EXPECT_LT((place(walker) - Vector3d(0.2, 0, 0)).norm(), 1e-12);
  press(walker, "sa");
  EXPECT_LT((place(walker) - Vector3d(0, 0.2, 0)).norm(), 1e-12);
  press(walker, "dqrre");
  EXPECT_LT((place(walker) - Vector3d(0, 0, 0.4)).norm(), 1e-12);
  press(walker, "ff");
  for (int i = 0; i < 18; ++i) press(walker, "<left>");
  press(walker, "<up><up>W");
  EXPECT_LT((place(walker) - Vector3d(0, 0.2, 0)).norm(), 1e-12) << "steps stay level";
}

TEST(Walker, TurnsAndLooksUpToALimit) {
  Walker walker(along_x(Vector3d::Zero()));
  press(walker, "<right>");
  EXPECT_NEAR(walker.yaw_rad(), -5 * kDegree, 1e-12);
  press(walker, "<left><up>");
  EXPECT_LT((gaze(walker) - Vector3d(std::cos(5 * kDegree), 0, std::sin(5 * kDegree))).norm(), 1e-12);
  for (int i = 0; i < 40; ++i) press(walker, "<down>");
  EXPECT_NEAR(walker.pitch_rad(), -89 * kDegree, 1e-12);
  for (int i = 0; i < 72; ++i) press(walker, "<right>");
  EXPECT_NEAR(walker.yaw_rad(), 0, 1e-9);
  EXPECT_NEAR((walker.T_world_camera().rotation * Vector3d::UnitX()).z(), 0, 1e-12) << "level";
}

TEST(Walker, ChangesItsSpeedWithinLimits) {
  Walker walker(along_x(Vector3d::Zero()), 1.0);
  EXPECT_EQ(press(walker, "+"), Effect::speed_changed);
  EXPECT_DOUBLE_EQ(walker.speed_m_per_s(), 1.25);
  press(walker, "-=_w");
  EXPECT_NEAR(place(walker).x(), 0.1, 1e-12);
  for (int i = 0; i < 100; ++i) press(walker, "+");
  EXPECT_EQ(walker.speed_m_per_s(), 100);
  for (int i = 0; i < 100; ++i) press(walker, "-");
  EXPECT_EQ(walker.speed_m_per_s(), 0.01);
}

TEST(Walker, DropsRemovesAndVisitsWayPoints) {
  Walker walker(along_x(Vector3d::Zero()), 10.0);
  EXPECT_EQ(press(walker, "u"), Effect::nothing);
  EXPECT_EQ(press(walker, "g"), Effect::nothing);
  EXPECT_EQ(press(walker, " "), Effect::dropped);
  EXPECT_EQ(press(walker, " "), Effect::stands_there);
  EXPECT_EQ(press(walker, "w "), Effect::dropped);
  EXPECT_EQ(press(walker, "<left><space>"), Effect::dropped);
  ASSERT_EQ(walker.points().size(), 3U);
  EXPECT_NEAR(walker.points()[1].translation.x(), 1, 1e-12);
  press(walker, "www");
  EXPECT_EQ(press(walker, "g"), Effect::moved);
  EXPECT_LT(place(walker).norm(), 1e-12);
  press(walker, "gg");
  EXPECT_LT(walker.T_world_camera().rotation.angularDistance(walker.points()[2].rotation), 1e-7);
  EXPECT_EQ(press(walker, "u"), Effect::removed);
  EXPECT_EQ(walker.points().size(), 2U);
  EXPECT_EQ(press(walker, "g"), Effect::moved);
  EXPECT_LT(place(walker).norm(), 1e-12) << "round and round";
}

TEST(Walker, LeavesTheRestToItsOwner) {
  Walker walker(along_x(Vector3d::Zero()));
  EXPECT_EQ(press(walker, "p"), Effect::preview);
  EXPECT_EQ(press(walker, "t"), Effect::play);
  EXPECT_EQ(press(walker, "?"), Effect::help);
  EXPECT_EQ(press(walker, "x"), Effect::leave);
  EXPECT_EQ(press(walker, "<esc>"), Effect::leave);
}

TEST(KeyReader, KnowsArrowsHoweverTheyComeInPieces) {
  const std::string bytes = "w\033[A\033OB\033[1;5C\033[D\033[200~x\xff\001?";
  const std::vector<Key> expected{Key::forward,   Key::look_up, Key::look_down, Key::turn_right,
                                  Key::turn_left, Key::leave,   Key::help};
  for (std::size_t cut = 0; cut <= bytes.size(); ++cut) {
    KeyReader reader;
    std::vector<Key> keys = reader.read(bytes.substr(0, cut));
    for (const Key key : reader.read(bytes.substr(cut))) keys.push_back(key);
    EXPECT_EQ(keys, expected) << cut;
    EXPECT_FALSE(reader.waits());
    EXPECT_TRUE(reader.finish().empty());
  }
}

TEST(KeyReader, TellsEscapeFromTheBeginningOfAnotherKey) {
  KeyReader reader;
  EXPECT_TRUE(reader.read("\033").empty());
  EXPECT_TRUE(reader.waits());
  EXPECT_EQ(reader.finish(), std::vector<Key>{Key::leave});
  EXPECT_TRUE(reader.read("\033[").empty());
  EXPECT_TRUE(reader.finish().empty()) << "a part of a key is not a key";
  EXPECT_EQ(reader.read("\033w"), std::vector<Key>{Key::forward}) << "with Alt";
  EXPECT_EQ(reader.read("\033\033[A"), (std::vector<Key>{Key::leave, Key::look_up}));
  EXPECT_TRUE(reader.read("\033[" + std::string(5000, '1')).size() < 5000);
  EXPECT_FALSE(reader.waits()) << "does not collect for ever";
}

TEST(Keys, OfATextAreThoseThatAreTyped) {
  EXPECT_EQ(keys_of("wd p<left><esc>"),
            (std::vector<Key>{Key::forward, Key::right, Key::drop, Key::preview, Key::turn_left, Key::leave}));
  EXPECT_TRUE(test::contains(test::message_of<UserError>([] { keys_of("wz"); }), "'z' is not a key"));
  EXPECT_TRUE(test::contains(test::message_of<UserError>([] { keys_of("<home>"); }), "'<' is not a key"));
}

}  // namespace
}  // namespace esim
