#include "esim/event_camera/front_end.h"

#include <cmath>
#include <limits>

#include "esim/core/vector_math.h"

namespace esim::inline event_camera {
namespace {

constexpr float kWhite = 255.0F;  // v2e uses the values of an 8-bit image

/// L = ln(255 E) above the knee; below, the straight line to L(0) = 0.
template <class D, class V>
V lin_log(D d, V irradiance, float knee) {
  const auto logarithmic = logarithm(d, hn::Mul(hn::Set(d, kWhite), hn::Max(irradiance, hn::Set(d, knee))));
  const auto linear = hn::Mul(irradiance, hn::Set(d, std::log(kWhite * knee) / knee));
  return hn::IfThenElse(hn::Gt(irradiance, hn::Set(d, knee)), logarithmic, linear);
}

}  // namespace

bool respond(const EventCameraOptions& options, std::size_t count, const float* irradiance, float* brightness) {
  bool valid = true;
  const auto run = [&](auto d, std::size_t first, std::size_t end) {
    const auto eps = hn::Set(d, static_cast<float>(options.log_eps));
    IrradianceCheck check(d);
    for (std::size_t i = first; i + hn::Lanes(d) <= end; i += hn::Lanes(d)) {
      const auto e = hn::LoadU(d, irradiance + i);
      check.see(d, e);
      const auto value = options.response == PixelResponse::log
                             ? logarithm(d, hn::Max(hn::Add(e, eps), hn::Set(d, std::numeric_limits<float>::min())))
                             : lin_log(d, e, static_cast<float>(options.lin_log_knee));
      hn::StoreU(value, d, brightness + i);
    }
    valid &= check.passed();
  };
  const hn::ScalableTag<float> whole;
  const std::size_t in_vectors = count / hn::Lanes(whole) * hn::Lanes(whole);
  run(whole, 0, in_vectors);
  run(hn::CappedTag<float, 1>(), in_vectors, count);
  return valid;
}

}  // namespace esim::inline event_camera
