#include "esim/video/interpolator.h"

#include <fmt/format.h>
#include <hwy/highway.h>
//
#include <hwy/contrib/math/math-inl.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>

#include "esim/core/error.h"

namespace esim::inline video {
namespace {

namespace hn = hwy::HWY_NAMESPACE;
using D = hn::ScalableTag<float>;
using V = hn::Vec<D>;

constexpr int kBorderBefore = 1, kBorderAfter = 2;  // repeated pixels for the 4 x 4 neighbourhood
constexpr int kRowsPerPiece = 16;

/// Change of brightness along the motion that is attributed to noise and aliased texture.
constexpr float kUnexplained = 0.5F;

/// Change of brightness above that of the noise of most videos.
constexpr float kChange = 0.2F;

template <typename Body>
void for_rows(int height, const Workers& workers, const Body& body) {
  workers.for_each((height + kRowsPerPiece - 1) / kRowsPerPiece, [&](int piece) {
    const int first = piece * kRowsPerPiece, last = std::min(first + kRowsPerPiece, height);
    for (int y = first; y < last; ++y) body(y);
  });
}

/// Weights of the four pixels around a point at `u` in [0, 1] between the second and the third: the cubic convolution
/// of Keys, 1981 (Catmull-Rom).
std::array<V, 4> cubic_weights(D d, V u) {
  const V half = hn::Set(d, 0.5F), two = hn::Set(d, 2.0F), v = hn::Sub(hn::Set(d, 1.0F), u);
  const V uv = hn::Mul(half, hn::Mul(u, v));
  const V w0 = hn::Neg(hn::Mul(uv, v)), w3 = hn::Neg(hn::Mul(uv, u));
  const V w1 = hn::NegMulAdd(two, w0, hn::Add(v, w3)), w2 = hn::NegMulAdd(two, w3, hn::Add(u, w0));
  return {w0, w1, w2, w3};
}

/// An image with a border, for sampling.
struct View {
  const float* origin;  // its pixel (0, 0)
  int stride, width, height;
};

/// The image at points (x, y); points outside are moved to its edge.
V sample(D d, const View& image, V x, V y) {
  const hn::RebindToSigned<D> di;
  x = hn::Min(hn::Max(x, hn::Zero(d)), hn::Set(d, static_cast<float>(image.width - 1)));
  y = hn::Min(hn::Max(y, hn::Zero(d)), hn::Set(d, static_cast<float>(image.height - 1)));
  const V x0 = hn::Floor(x), y0 = hn::Floor(y);
  const auto wx = cubic_weights(d, hn::Sub(x, x0)), wy = cubic_weights(d, hn::Sub(y, y0));
  const auto index = hn::Add(hn::Mul(hn::ConvertTo(di, y0), hn::Set(di, image.stride)), hn::ConvertTo(di, x0));
  V sum = hn::Zero(d);
  for (int j = 0; j < 4; ++j) {
    const float* row = image.origin + (j - 1) * image.stride - 1;
    V across = hn::Mul(wx[0], hn::GatherIndex(d, row, index));
    for (int i = 1; i < 4; ++i) {
      across = hn::MulAdd(wx[static_cast<std::size_t>(i)], hn::GatherIndex(d, row + i, index), across);
    }
    sum = hn::MulAdd(wy[static_cast<std::size_t>(j)], across, sum);
  }
  return sum;
}

/// The image at a point; points outside are moved to its edge.
float bilinear(const Image<float>& image, float x, float y) {
  x = std::clamp(x, 0.0F, static_cast<float>(image.width() - 1));
  y = std::clamp(y, 0.0F, static_cast<float>(image.height() - 1));
  const int x0 = static_cast<int>(x), y0 = static_cast<int>(y);
  const int x1 = std::min(x0 + 1, image.width() - 1), y1 = std::min(y0 + 1, image.height() - 1);
  const float u = x - static_cast<float>(x0), v = y - static_cast<float>(y0);
  return (1 - v) * ((1 - u) * image(x0, y0) + u * image(x1, y0)) + v * ((1 - u) * image(x0, y1) + u * image(x1, y1));
}

/// Weights of the displacements u and v towards frame 0 and frame 1, at the fraction s between them.
struct Shares {
  explicit Shares(float s)
      : u0(0.5F * (s * s - s)),
        v0(0.5F * (s * s + s)),
        u1(0.5F * ((1 - s) * (1 - s) + (1 - s))),
        v1(0.5F * ((1 - s) * (1 - s) - (1 - s))) {}
  float u0, v0, u1, v1;
};

/// ln(E + log_eps) of the pixels from (x, y) on at the fraction s, motion compensated if the motion explains the
/// frames.
V blend(D d, const View& frame0, const View& frame1, int x, int y, float s, V ux, V uy, V vx, V vy) {
  const std::ptrdiff_t at = std::ptrdiff_t{y} * frame0.stride + x;
  const V fraction = hn::Set(d, s);
  const V still0 = hn::LoadU(d, frame0.origin + at), still1 = hn::LoadU(d, frame1.origin + at);
  const V still_change = hn::Sub(still1, still0);
  const V still = hn::MulAdd(fraction, still_change, still0);
  const V farthest = hn::Max(hn::Max(hn::Abs(ux), hn::Abs(uy)), hn::Max(hn::Abs(vx), hn::Abs(vy)));
  if (hn::AllTrue(d, hn::Eq(farthest, hn::Zero(d)))) return still;

  const Shares shares(s);
  const V column = hn::Add(hn::Set(d, static_cast<float>(x)), hn::Iota(d, 0)), row = hn::Set(d, static_cast<float>(y));
  const auto moved = [&](const View& frame, float u, float v) {
    const V u_fraction = hn::Set(d, u), v_fraction = hn::Set(d, v);
    return sample(d, frame, hn::MulAdd(u_fraction, ux, hn::MulAdd(v_fraction, vx, column)),
                  hn::MulAdd(u_fraction, uy, hn::MulAdd(v_fraction, vy, row)));
  };
  const V moved0 = moved(frame0, shares.u0, shares.v0), moved1 = moved(frame1, shares.u1, shares.v1);
  const V change = hn::Sub(moved1, moved0);

  // The weight of the motion decreases with the difference along it, relative to the difference in place.
  const V room = hn::MulAdd(still_change, still_change, hn::Set(d, kUnexplained * kUnexplained));
  const V doubt = hn::Div(hn::Mul(change, change), room), one = hn::Set(d, 1.0F);
  const V belief = hn::Div(one, hn::MulAdd(doubt, doubt, one));
  return hn::MulAdd(belief, hn::Sub(hn::MulAdd(fraction, change, moved0), still), still);
}

}  // namespace

void Interpolator::PaddedLog::assign(const Image<float>& light, float log_eps, const Workers& workers) {
  const int width = light.width(), height = light.height();
  if (pixels.empty())
    pixels = Image<float>(width + kBorderBefore + kBorderAfter, height + kBorderBefore + kBorderAfter);
  const D d;
  const int lanes = static_cast<int>(hn::Lanes(d));
  for_rows(pixels.height(), workers, [&](int row) {
    const float* in = light.row(std::clamp(row - kBorderBefore, 0, height - 1));
    float* const out = pixels.row(row) + kBorderBefore;
    int x = 0;
    for (; x + lanes <= width; x += lanes) {
      hn::StoreU(hn::Log(d, hn::Add(hn::LoadU(d, in + x), hn::Set(d, log_eps))), d, out + x);
    }
    for (; x < width; ++x) out[x] = std::log(in[x] + log_eps);
    out[-1] = out[0];
    out[width] = out[width + 1] = out[width - 1];
  });
}

void Interpolator::advance(const Frame& frame, const Workers& workers) {
  if (images_ != nullptr) {
    std::swap(frame0_, frame1_);
    frame1_ = frame;
  } else {
    std::swap(before_, after_);
    after_.resize(frame.planes.size());
    for (std::size_t i = 0; i < frame.planes.size(); ++i) {
      after_[i].assign(frame.planes[i], static_cast<float>(log_eps_), workers);
    }
  }
  if (options_.interpolation) measure_motion(frame.planes, workers);
}

void Interpolator::measure_motion(const Planes& frame, const Workers& workers) {
  const int width = frame.front().width(), height = frame.front().height();
  const bool first = luminance_after_.empty();
  std::swap(luminance_before_, luminance_after_);
  luminance_after_ = frame.front();
  if (frame.size() == 3) {
    for_rows(height, workers, [&](int y) {
      const float *red = frame[0].row(y), *green = frame[1].row(y), *blue = frame[2].row(y);
      for (int x = 0; x < width; ++x) luminance_after_(x, y) = luminance(red[x], green[x], blue[x]);
    });
  }
  if (first) {
    optical_flow_ = std::make_unique<OpticalFlow>(width, height);
    return;
  }
  optical_flow_->estimate(luminance_before_, luminance_after_, workers, forward_, backward_);
  choose_steps(workers);
  count_followed(workers);
}

/// The speed along the parabola changes linearly: its maximum is at one of the ends.
void Interpolator::choose_steps(const Workers& workers) {
  const int width = luminance_after_.width(), height = luminance_after_.height();
  std::vector<float> row_max(static_cast<std::size_t>(height), 0.0F);  // squared, per row
  for_rows(height, workers, [&](int y) {
    for (int x = 0; x < width; ++x) {
      const float ux = forward_.x(x, y), uy = forward_.y(x, y), vx = backward_.x(x, y), vy = backward_.y(x, y);
      const float x0 = 0.5F * ux + 1.5F * vx, x1 = 1.5F * ux + 0.5F * vx;
      const float y0 = 0.5F * uy + 1.5F * vy, y1 = 1.5F * uy + 0.5F * vy;
      float& largest = row_max[static_cast<std::size_t>(y)];
      largest = std::max({largest, x0 * x0 + y0 * y0, x1 * x1 + y1 * y1});
    }
  });
  max_flow_px_ = std::sqrt(static_cast<double>(*std::max_element(row_max.begin(), row_max.end())));
  const double steps = std::max(1.0, std::ceil(max_flow_px_ / options_.lambda));
  held_ = steps > options_.max_steps;
  steps_ = held_ ? options_.max_steps : static_cast<int>(steps);
}

void Interpolator::count_followed(const Workers& workers) {
  const int width = luminance_after_.width(), height = luminance_after_.height();
  const float log_eps = static_cast<float>(log_eps_), smallest_ratio = std::exp(kChange);
  std::vector<FollowedPixels> rows(static_cast<std::size_t>(height));
  for_rows(height, workers, [&](int y) {
    FollowedPixels& row = rows[static_cast<std::size_t>(y)];
    for (int x = 0; x < width; ++x) {
      const float before = luminance_before_(x, y) + log_eps, after = luminance_after_(x, y) + log_eps;
      if (std::max(before, after) <= smallest_ratio * std::min(before, after)) continue;  // also 0 and 0
      ++row.changed;
      if (forward_.found(x, y) == 0) continue;
      const float there = bilinear(luminance_after_, static_cast<float>(x) + forward_.x(x, y),
                                   static_cast<float>(y) + forward_.y(x, y));
      const float difference = std::abs(std::log((there + log_eps) / before));
      if (difference < std::max(0.5F * std::abs(std::log(after / before)), kUnexplained)) ++row.followed;
    }
  });
  followed_ = {};
  for (const FollowedPixels& row : rows) {
    followed_.changed += row.changed;
    followed_.followed += row.followed;
  }
}

void Interpolator::ask_for_image(double fraction, Planes& light) const {
  const auto fail = [&](const std::string& what) {
    const double t = static_cast<double>(frame0_.t) + fraction * static_cast<double>(frame1_.t - frame0_.t);
    throw UserError(fmt::format("{}, for the image at {:.9f} s between the frames at {:.9f} s and {:.9f} s: {}",
                                images_->name(), 1e-9 * t, to_seconds(frame0_.t), to_seconds(frame1_.t), what));
  };
  try {
    images_->between(frame0_, frame1_, fraction, light);
  } catch (const UserError& error) {
    fail(error.what());
  }
  const bool fits = light.size() == frame0_.planes.size() && light.front().width() == frame0_.planes.front().width() &&
                    light.front().height() == frame0_.planes.front().height();
  if (!fits) fail("the image must have the size and the number of planes of the frames");
  if (const std::string problem = problem_of(light); !problem.empty()) fail(problem);
}

void Interpolator::at(double fraction, const Workers& workers, Planes& light) const {
  if (images_ != nullptr) return ask_for_image(fraction, light);
  const int width = after_.front().pixels.width() - kBorderBefore - kBorderAfter;
  const int height = after_.front().pixels.height() - kBorderBefore - kBorderAfter;
  resize(light, width, height, after_.size() == 3);
  for_rows(height, workers, [&](int y) {
    for (std::size_t plane = 0; plane < light.size(); ++plane) {
      interpolate_row(y, static_cast<float>(fraction), plane, light[plane].row(y));
    }
  });
}

void Interpolator::interpolate_row(int y, float s, std::size_t plane, float* light) const {
  const D d;
  const int lanes = static_cast<int>(hn::Lanes(d));
  const Image<float>& padded = before_[plane].pixels;
  const int width = padded.width() - kBorderBefore - kBorderAfter,
            height = padded.height() - kBorderBefore - kBorderAfter;
  const View frame0{before_[plane].row(0), padded.width(), width, height};
  const View frame1{after_[plane].row(0), padded.width(), width, height};
  const float log_eps = static_cast<float>(log_eps_);
  if (width < lanes || forward_.x.empty()) {  // without motion
    const float *log0 = before_[plane].row(y), *log1 = after_[plane].row(y);
    for (int x = 0; x < width; ++x) light[x] = std::max(std::exp(log0[x] + s * (log1[x] - log0[x])) - log_eps, 0.0F);
    return;
  }
  for (int begin = 0; begin < width; begin += lanes) {
    const int x = std::min(begin, width - lanes);  // the last vector overlaps the previous one
    const auto load = [&](const Image<float>& field) { return hn::LoadU(d, field.row(y) + x); };
    const V log =
        blend(d, frame0, frame1, x, y, s, load(forward_.x), load(forward_.y), load(backward_.x), load(backward_.y));
    hn::StoreU(hn::Max(hn::Sub(hn::Exp(d, log), hn::Set(d, log_eps)), hn::Zero(d)), d, light + x);
  }
}

}  // namespace esim::inline video
