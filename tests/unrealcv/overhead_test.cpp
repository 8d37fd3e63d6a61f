#include <chrono>

#include "unrealcv/ready_server.h"

namespace esim {
namespace {

TEST(UnrealcvOverhead, AFrameCostsLittleBesideTheEnginesOwnTime) {
  // bench_unrealcv measures the time. On a busy machine, a single fast frame shows that nothing sleeps, and that no
  // answer waits for a timer.
  constexpr double kEnough_s = 0.015;
  const Camera camera = Camera::from_fov(346, 260, 1.3);
  for (const bool png : {false, true}) {
    const auto server = test::ready_server(camera, png);
    const auto renderer = test::renderer_for(test::options_for(*server, 30), camera);
    test::render(*renderer, camera, {});
    double min_s = 1e9;
    for (int i = 0; i < 200 && min_s > kEnough_s; ++i) {
      const auto start = std::chrono::steady_clock::now();
      test::render(*renderer, camera, test::moving_camera(1e-3 * i));
      min_s = std::min(min_s, std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
    }
    EXPECT_LT(min_s, kEnough_s) << (png ? "png" : "npy");
  }
}

}  // namespace
}  // namespace esim
