#include <gtest/gtest.h>

#include "esim/compose/compose.h"
#include "esim/core/error.h"
#include "esim/scenario/read.h"
#include "support/errors.h"
#include "support/reconstruction.h"
#include "support/temporary_directory.h"

namespace esim {
namespace {

using test::contains;

/// A COLMAP model of a camera that moves along x, with y down in the file.
struct ImageWorld {
  test::TemporaryDirectory folder;
  std::vector<std::string> notes;

  ImageWorld() {
    std::vector<test::ModelImage> images;
    for (int i = 0; i < 31; ++i)
      images.push_back({.id = static_cast<std::uint32_t>(i), .t = {-0.1 * i, 0, 0}, .name = fmt::format("{}.png", i)});
    folder.write("images.bin", test::images_bin(images));
    folder.write("cameras.bin", test::cameras_bin({{}}));
    folder.write("motion.txt", "0 0 0 0 0 0 0 1\n1 0 0 0 0 0 0 1\n");
    folder.write("texture.pgm", "P2 2 2 255 0 255 255 0\n");
  }

  World build(const std::string& trajectory) {
    const auto file = folder.write("scenario.yaml",
                                   "renderer: {type: panorama, image: texture.pgm}\n"
                                   "camera: {calibration: .}\ntrajectory: {type: file, " +
                                       trajectory + "}\n");
    notes.clear();
    return build_world(read_scenario(file), 1,
                       {[](const std::string& text) { ADD_FAILURE() << text; },
                        [&](const std::string& text) { notes.push_back(text); }});
  }
  std::string error(const std::string& trajectory) {
    return test::message_of<UserError>([&] { build(trajectory); });
  }
};

TEST(ImageTrajectory, SaysTheRateAndTheUpDirection) {
  ImageWorld images;
  const World world = images.build("path: .");
  EXPECT_EQ(world.info.end, kNsPerSecond);
  ASSERT_FALSE(images.notes.empty());
  EXPECT_TRUE(contains(images.notes[0],
                       "31 poses at 30 Hz; the images' mean up direction is [0.00, -1.00, 0.00]; "
                       "trajectory.up turns it to z"));
  images.build("path: ., up: [0, -1, 0]");
  EXPECT_TRUE(contains(images.notes[0], "31 poses at 30 Hz"));
  EXPECT_EQ(images.notes[0].find("mean up direction"), std::string::npos);
  images.build("path: motion.txt");
  EXPECT_TRUE(contains(images.notes[0], "fitted 2 poses"));
}

TEST(ImageTrajectory, HasTheRateTheScaleAndTheUpDirectionOfItsOptions) {
  ImageWorld images;
  const World world = images.build("path: ., rate_hz: 15, scale: 0.5, up: [0, -1, 0], time_scale: 2");
  EXPECT_EQ(world.info.end, 4 * kNsPerSecond);
  const SE3 T = world.trajectory->at(2 * kNsPerSecond).T_world_body;
  EXPECT_LT((T.translation - Eigen::Vector3d(0.75, 0, 0)).norm(), 1e-6);
  EXPECT_LT((T.rotation * Eigen::Vector3d(0, -1, 0) - Eigen::Vector3d::UnitZ()).norm(), 1e-6);
  EXPECT_TRUE(contains(images.error("path: ., up: [0, 0, 0]"), "trajectory.up must be a direction"));
  EXPECT_TRUE(contains(images.error("path: motion.txt, rate_hz: 30"), "so that rate_hz must not be given"));
}

}  // namespace
}  // namespace esim
