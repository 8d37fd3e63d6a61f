#include "esim/video/optical_flow.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <opencv2/core.hpp>
#include <opencv2/video/tracking.hpp>
#include <vector>

namespace esim::inline video {
namespace {

constexpr int kMinSide = 16;          // px; smaller images have no search pyramid
constexpr float kNoise = 0.1F;        // px; slower motion counts as 0
constexpr std::size_t kLooks = 4096;  // pixels that determine the scale
constexpr int kRowsAtOnce = 16;

/// Nearly the maximum irradiance of an image: a quantile, so that single hot pixels do not darken the others.
float white_level(const Image<float>& light) {
  const std::size_t stride = std::max<std::size_t>(1, light.size() / kLooks);
  std::vector<float> values;
  for (std::size_t i = 0; i < light.size(); i += stride) values.push_back(light.pixels()[i]);
  const auto high = values.begin() + static_cast<std::ptrdiff_t>((values.size() - 1) * 99 / 100);
  std::nth_element(values.begin(), high, values.end());
  return std::max(*high, 1e-6F);
}

float squared(float x, float y) { return x * x + y * y; }

cv::Vec2f bilinear(const cv::Mat2f& field, float x, float y) {
  x = std::clamp(x, 0.0F, static_cast<float>(field.cols - 1));
  y = std::clamp(y, 0.0F, static_cast<float>(field.rows - 1));
  const int x0 = static_cast<int>(x), y0 = static_cast<int>(y);
  const int x1 = std::min(x0 + 1, field.cols - 1), y1 = std::min(y0 + 1, field.rows - 1);
  const float u = x - static_cast<float>(x0), v = y - static_cast<float>(y0);
  return (1 - v) * ((1 - u) * field(y0, x0) + u * field(y0, x1)) + v * ((1 - u) * field(y1, x0) + u * field(y1, x1));
}

/// Forward-backward consistency (Sundaram et al., ECCV 2010, eq. 5): whether `there` followed by `back` leads close to
/// the start, within the image.
bool is_consistent(const cv::Mat2f& there, const cv::Mat2f& back, int x, int y) {
  const cv::Vec2f go = there(y, x);
  const float to_x = static_cast<float>(x) + go[0], to_y = static_cast<float>(y) + go[1];
  const bool inside = to_x >= -0.5F && to_y >= -0.5F && to_x <= static_cast<float>(there.cols) - 0.5F &&
                      to_y <= static_cast<float>(there.rows) - 0.5F;
  if (!inside) return false;
  const cv::Vec2f come = bilinear(back, to_x, to_y);
  return squared(go[0] + come[0], go[1] + come[1]) < 0.01F * (squared(go[0], go[1]) + squared(come[0], come[1])) + 0.5F;
}

cv::Vec2f without_noise(cv::Vec2f flow) { return squared(flow[0], flow[1]) < kNoise * kNoise ? cv::Vec2f(0, 0) : flow; }

}  // namespace

struct OpticalFlow::Impl {
  Impl(int width, int height) {
    for (cv::Ptr<cv::DISOpticalFlow>& search : searches) {
      search = cv::DISOpticalFlow::create(cv::DISOpticalFlow::PRESET_MEDIUM);
      search->setGradientDescentIterations(12);  // as good as the preset's 25
    }
    for (cv::Mat1b& image : images) image.create(height, width);
    for (cv::Mat2f& field : fields) field = cv::Mat2f::zeros(height, width);
  }

  void encode(const Image<float>& light, float white, cv::Mat1b& out) const {
    for (int y = 0; y < out.rows; ++y) {
      const float* in = light.row(y);
      std::uint8_t* codes = out[y];
      for (int x = 0; x < out.cols; ++x) {
        codes[x] = static_cast<std::uint8_t>(255.0F * std::sqrt(std::min(in[x] / white, 1.0F)) + 0.5F);
      }
    }
  }

  void clean_row(int y, FlowField& forward, FlowField& backward) const {
    for (int x = 0; x < fields[0].cols; ++x) {
      cv::Vec2f u = fields[0](y, x), v = fields[1](y, x);
      const bool u_holds = is_consistent(fields[0], fields[1], x, y);
      const bool v_holds = is_consistent(fields[1], fields[0], x, y);
      if (!u_holds) u = v_holds ? -v : cv::Vec2f(0, 0);
      if (!v_holds) v = -u;
      u = without_noise(u), v = without_noise(v);
      forward.x(x, y) = u[0], forward.y(x, y) = u[1];
      backward.x(x, y) = v[0], backward.y(x, y) = v[1];
      forward.found(x, y) = backward.found(x, y) = u_holds || v_holds ? 1 : 0;
    }
  }

  // One per direction, so that both can run in parallel.
  std::array<cv::Ptr<cv::DISOpticalFlow>, 2> searches;
  std::array<cv::Mat1b, 2> images;
  std::array<cv::Mat2f, 2> fields;
};

OpticalFlow::OpticalFlow(int width, int height) : impl_(std::make_unique<Impl>(width, height)) {}
OpticalFlow::~OpticalFlow() = default;
OpticalFlow::OpticalFlow(OpticalFlow&&) noexcept = default;
OpticalFlow& OpticalFlow::operator=(OpticalFlow&&) noexcept = default;

void OpticalFlow::estimate(const Image<float>& before, const Image<float>& after, const Workers& workers,
                           FlowField& forward, FlowField& backward) {
  Impl& impl = *impl_;
  const int width = before.width(), height = before.height();
  for (FlowField* field : {&forward, &backward}) {
    if (field->x.width() != width || field->x.height() != height)
      *field = {Image<float>(width, height), Image<float>(width, height), Image<std::uint8_t>(width, height)};
  }
  if (std::min(width, height) >= kMinSide) {
    const float white = std::max(white_level(before), white_level(after));
    workers.for_each(2, [&](int i) { impl.encode(i == 0 ? before : after, white, impl.images[i]); });
    cv::setNumThreads(1);  // the result of the search depends on the number of threads
    workers.for_each(2, [&](int i) { impl.searches[i]->calc(impl.images[i], impl.images[1 - i], impl.fields[i]); });
  }
  workers.for_each((height + kRowsAtOnce - 1) / kRowsAtOnce, [&](int piece) {
    const int first = piece * kRowsAtOnce;
    for (int y = first; y < std::min(first + kRowsAtOnce, height); ++y) impl.clean_row(y, forward, backward);
  });
}

}  // namespace esim::inline video
