#include "esim/render/point_spread.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "esim/core/error.h"
#include "esim/render/bands.h"

namespace esim::inline render {
namespace {

/// Disjoint tiles that cover the given ones, each widened by `by` px on all sides, within an image.
std::vector<Tile> widened(const std::vector<Tile>& tiles, int by, int width, int height) {
  std::vector<Tile> wide;
  std::vector<int> ends;  // rows at which a tile begins or ends
  for (const Tile& tile : tiles) {
    const int left = std::max(tile.x - by, 0), top = std::max(tile.y - by, 0);
    const int right = std::min(tile.x + tile.width + by, width), bottom = std::min(tile.y + tile.height + by, height);
    wide.push_back({left, top, right - left, bottom - top});
    ends.push_back(top), ends.push_back(bottom);
  }
  std::sort(ends.begin(), ends.end());
  ends.erase(std::unique(ends.begin(), ends.end()), ends.end());
  std::sort(wide.begin(), wide.end(), [](const Tile& a, const Tile& b) { return a.x < b.x; });
  std::vector<Tile> cover;
  for (std::size_t i = 0; i + 1 < ends.size(); ++i) {
    const int top = ends[i], rows = ends[i + 1] - top;
    const std::size_t first = cover.size();
    for (const Tile& tile : wide) {
      if (tile.y > top || tile.y + tile.height < top + rows) continue;
      if (cover.size() > first && tile.x <= cover.back().x + cover.back().width) {
        cover.back().width = std::max(cover.back().width, tile.x + tile.width - cover.back().x);
      } else {
        cover.push_back({tile.x, top, tile.width, rows});
      }
    }
  }
  return cover;
}

class BlurredRenderer final : public Renderer {
 public:
  /// `inner` sees `margin` px more on all sides; if 0, pixels at the border are repeated.
  BlurredRenderer(std::unique_ptr<Renderer> inner, int width, int height, int margin, std::vector<float> kernel,
                  const Workers& workers)
      : inner_(std::move(inner)),
        width_(width),
        height_(height),
        margin_(margin),
        kernel_(std::move(kernel)),
        workers_(workers) {}

  RendererTraits traits() const override { return inner_->traits(); }

  std::unique_ptr<Rendering> start(RenderRequest request) override {
    std::vector<RenderRequest> requests;
    requests.push_back(std::move(request));
    return start_together(std::move(requests));
  }
  std::unique_ptr<Rendering> start_together(std::vector<RenderRequest> requests) override;

 private:
  class Blurring;

  int reach() const { return static_cast<int>(kernel_.size()) - 1; }

  /// Fills a tile of `sample` from the inner renderer's sample.
  void blur(const Sample& sharp, const Tile& tile, Sample& sample) const;

  std::unique_ptr<Renderer> inner_;
  int width_, height_, margin_;
  std::vector<float> kernel_;
  const Workers& workers_;
};

class BlurredRenderer::Blurring final : public Rendering {
 public:
  /// Tiles at different times may be blurred from the same pixels, so each request is rendered separately.
  Blurring(const BlurredRenderer& renderer, std::vector<RenderRequest> requests)
      : renderer_(renderer), requests_(std::move(requests)) {
    const int margin = renderer_.margin_;
    for (const RenderRequest& request : requests_) {
      RenderRequest inner = request;
      for (Tile& tile : inner.tiles) tile.x += margin, tile.y += margin;
      inner.tiles =
          widened(inner.tiles, renderer_.reach(), renderer_.width_ + 2 * margin, renderer_.height_ + 2 * margin);
      if (margin % inner.motion_rows != 0) inner.motion_rows = 1;
      renderings_.push_back(renderer_.inner_->start(std::move(inner)));
    }
  }

  void finish(Sample& sample) override {
    prepare(requests_, renderer_.width_, renderer_.height_, sample, renderer_.traits().deforms);
    Sample sharp;
    for (std::size_t i = 0; i < requests_.size(); ++i) {
      renderings_[i]->finish(sharp);
      std::vector<Tile> bands;
      for (const Tile& tile : requests_[i].tiles) {
        constexpr int kRows = 32;
        for (int y = 0; y < tile.height; y += kRows)
          bands.push_back({tile.x, tile.y + y, tile.width, std::min(kRows, tile.height - y)});
      }
      renderer_.workers_.for_each(static_cast<int>(bands.size()), [&](int band) {
        renderer_.blur(sharp, bands[static_cast<std::size_t>(band)], sample);
      });
    }
  }

 private:
  const BlurredRenderer& renderer_;
  std::vector<RenderRequest> requests_;
  std::vector<std::unique_ptr<Rendering>> renderings_;
};

std::unique_ptr<Rendering> BlurredRenderer::start_together(std::vector<RenderRequest> requests) {
  return std::make_unique<Blurring>(*this, std::move(requests));
}

// Not a filter of OpenCV, which rounds pixels differently by their place in a tile.
void BlurredRenderer::blur(const Sample& sharp, const Tile& tile, Sample& sample) const {
  const int reach = this->reach(), last_column = sharp.irradiance.width() - 1, last_row = sharp.irradiance.height() - 1;
  Image<float> across(tile.width, tile.height + 2 * reach);
  for (int row = 0; row < across.height(); ++row) {
    const float* const from = sharp.irradiance.row(std::clamp(tile.y + margin_ - reach + row, 0, last_row));
    float* const to = across.row(row);
    for (int x = 0; x < tile.width; ++x) {
      const int centre = tile.x + margin_ + x;
      float sum = kernel_[0] * from[centre];
      for (int k = 1; k <= reach; ++k)
        sum += kernel_[static_cast<std::size_t>(k)] *
               (from[std::max(centre - k, 0)] + from[std::min(centre + k, last_column)]);
      to[x] = sum;
    }
  }
  for (int y = 0; y < tile.height; ++y) {
    float* const to = sample.irradiance.row(tile.y + y) + tile.x;
    const float* const centre = across.row(y + reach);
    for (int x = 0; x < tile.width; ++x) to[x] = kernel_[0] * centre[x];
    for (int k = 1; k <= reach; ++k) {
      const float *const above = across.row(y + reach - k), *const below = across.row(y + reach + k);
      const float weight = kernel_[static_cast<std::size_t>(k)];
      for (int x = 0; x < tile.width; ++x) to[x] += weight * (above[x] + below[x]);
    }
    const auto copy = [&](const auto& all, auto& into) {
      std::copy_n(all.row(tile.y + margin_ + y) + tile.x + margin_, tile.width, into.row(tile.y + y) + tile.x);
    };
    copy(sharp.depth, sample.depth), copy(sharp.motion_x, sample.motion_x), copy(sharp.motion_y, sample.motion_y);
    if (!sample.object.empty()) copy(sharp.object, sample.object);
    if (!sample.surface.empty()) copy(sharp.surface, sample.surface);
  }
}

}  // namespace

std::vector<float> gaussian_half_kernel(double sigma) {
  // Weights exp(-k^2 / 2 s^2), with s so that the variance of the samples is sigma^2. For sigma above 0.7, s = sigma.
  const int reach = static_cast<int>(std::ceil(4 * sigma));
  const auto kernel = [&](double s) {
    std::vector<double> half;
    double sum = 0;
    for (int k = 0; k <= reach; ++k)
      half.push_back(std::exp(-0.5 * k * k / (s * s))), sum += (k > 0 ? 2 : 1) * half.back();
    for (double& weight : half) weight /= sum;
    return half;
  };
  double low = 0.05 * sigma, high = 4 * sigma;
  for (int i = 0; i < 60; ++i) {
    const double s = 0.5 * (low + high);
    const std::vector<double> half = kernel(s);
    double variance = 0;
    for (std::size_t k = 1; k < half.size(); ++k) variance += 2 * half[k] * static_cast<double>(k * k);
    (variance < sigma * sigma ? low : high) = s;
  }
  const std::vector<double> half = kernel(high);
  return {half.begin(), half.end()};
}

std::unique_ptr<Renderer> with_point_spread(const std::function<std::unique_ptr<Renderer>(const Camera& camera)>& make,
                                            const Camera& camera, double sigma, bool sees_more,
                                            const Workers& workers) {
  std::unique_ptr<Renderer> inner = make(camera);
  if (inner == nullptr || sigma == 0) return inner;
  std::vector<float> kernel = gaussian_half_kernel(sigma);
  int margin = 0;
  if (sees_more && !inner->traits().on_sensor) {
    margin = static_cast<int>(kernel.size()) - 1;
    Camera larger = camera;
    larger.width += 2 * margin, larger.height += 2 * margin, larger.cx += margin, larger.cy += margin;
    try {
      larger.validate();
    } catch (const UserError& error) {
      throw UserError(
          fmt::format("psf_px: {} needs light from {} px outside the image: {}", sigma, margin, error.what()));
    }
    inner = make(larger);
  }
  return std::make_unique<BlurredRenderer>(std::move(inner), camera.width, camera.height, margin, std::move(kernel),
                                           workers);
}

}  // namespace esim::inline render
