#include "esim/light/flicker.h"

#include <algorithm>
#include <limits>

#include "esim/core/vector_math.h"

namespace esim::inline light {
namespace {

constexpr std::size_t kPixelsPerBatch = 1U << 20U, kPlatesPerBatch = 8;  // at least
constexpr int kPixelsPerPiece = 16384;                                   // per task of a parallel loop

/// The irradiance E of a row at fraction `s` of a segment in constant light, times `factor`. ln(E + dark) is linear in
/// time.
void interpolate(std::size_t count, const float* e0, const float* e1, float s, float dark, float factor, float* out) {
  const auto run = [&](auto d, std::size_t first, std::size_t end) {
    const auto smallest = hn::Set(d, std::numeric_limits<float>::min()), one = hn::Set(d, 1.0F);
    const auto add = hn::Set(d, dark), fraction = hn::Set(d, s), m = hn::Set(d, factor);
    for (std::size_t i = first; i + hn::Lanes(d) <= end; i += hn::Lanes(d)) {
      const auto a = hn::LoadU(d, e0 + i), b = hn::LoadU(d, e1 + i);
      const auto from = hn::Max(hn::Add(a, add), smallest), to = hn::Max(hn::Add(b, add), smallest);
      const auto change = hn::Mul(fraction, logarithm(d, hn::Max(hn::Div(to, from), smallest)));
      const auto e = hn::Max(hn::MulAdd(from, hn::Sub(hn::Exp(d, change), one), a), hn::Zero(d));
      hn::StoreU(hn::Mul(m, e), d, out + i);
    }
  };
  const hn::ScalableTag<float> whole;
  const std::size_t in_vectors = count / hn::Lanes(whole) * hn::Lanes(whole);
  run(whole, 0, in_vectors);
  run(hn::CappedTag<float, 1>(), in_vectors, count);
}

void scale(std::size_t count, const float* e, float factor, float* out) {
  for (std::size_t i = 0; i < count; ++i) out[i] = factor * e[i];
}

}  // namespace

// --- which light the pixels see --------------------------------------------------------------------------------------

/// Keeps the objects at the end of each tile's last segment.
void Flicker::keep_objects() {
  for (const auto& [tile, objects] : objects_) {
    for (int y = 0; y < tile.height; ++y)
      std::copy_n(objects.row(y), tile.width, last_objects_.row(tile.y + y) + tile.x);
  }
  objects_.clear();
}

void Flicker::look(std::span<const Segment> segments, int width, int height, const RenderObjects& render) {
  segments_ = segments;
  ends_.assign(segments.size(), {});
  if (!light_.has_sources()) {
    for (Ends& ends : ends_) ends.lights = {0};
    return;
  }
  if (last_objects_.empty()) last_objects_ = Image<std::uint16_t>(width, height);
  keep_objects();
  objects_.reserve(segments.size());
  for (std::size_t i = 0; i < segments.size(); ++i) {
    const Tile& tile = segments[i].tile;
    render(segments[i].t1, tile, sample_);
    Image<std::uint16_t>& objects = objects_.emplace_back(tile, Image<std::uint16_t>(tile.width, tile.height)).second;
    for (int y = 0; y < tile.height; ++y)
      std::copy_n(sample_.object.row(tile.y + y) + tile.x, tile.width, objects.row(y));
    ends_[i].after = {objects.data(), tile};
    if (segments[i].t0 == segments[i].t1) {
      ends_[i].before = ends_[i].after;
    } else {
      const bool continues = i > 0 && segments[i - 1].tile == tile;
      ends_[i].before = continues ? ends_[i - 1].after : ImageView<std::uint16_t>(&last_objects_);
    }
    ends_[i].lights = lights_of(tile, ends_[i]);
  }
}

std::vector<std::size_t> Flicker::lights_of(const Tile& tile, const Ends& ends) const {
  std::vector<char> seen(light_.lights(), 0);
  for (int y = tile.y; y < tile.y + tile.height; ++y) {
    for (int x = tile.x; x < tile.x + tile.width; ++x)
      seen[light_.light_of(ends.before(x, y))] = seen[light_.light_of(ends.after(x, y))] = 1;
  }
  std::vector<std::size_t> lights;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    if (seen[i] != 0) lights.push_back(i);
  }
  return lights;
}

// --- dividing segments -----------------------------------------------------------------------------------------------

TimeNs Flicker::next_node(std::size_t segment, TimeNs t) const {
  TimeNs next = segments_[segment].t1;
  for (const std::size_t light : ends_[segment].lights) next = std::min(next, light_.next_node(t, light));
  return next;
}

void Flicker::add_plate(std::size_t segment, TimeNs t) {
  plates_.push_back({segment, memory_.size(), t});
  memory_.resize(memory_.size() + segments_[segment].tile.area());
  for (std::size_t light = 0; light < light_.lights(); ++light)
    factors_.push_back(static_cast<float>(light_.at_of_light(t, light)));
}

void Flicker::divide(TimeNs watermark, const Workers& workers, const Take& take) {
  // Before the rest of the i-th segment and all later ones.
  std::vector<TimeNs> earliest(segments_.size() + 1, watermark);
  for (std::size_t i = segments_.size(); i-- > 0;) earliest[i] = std::min(earliest[i + 1], segments_[i].t0);
  for (std::size_t i = 0; i < segments_.size(); ++i) {
    const Segment& segment = segments_[i];
    add_plate(i, segment.t0);
    for (TimeNs t = segment.t0; t < segment.t1;) {
      t = next_node(i, t);
      add_plate(i, t);
      if (memory_.size() < kPixelsPerBatch || plates_.size() < kPlatesPerBatch) continue;
      pass_on(t < segment.t1 ? std::min(t, earliest[i + 1]) : earliest[i + 1], workers, take);
      if (t < segment.t1) add_plate(i, t);
    }
  }
  pass_on(watermark, workers, take);
}

/// Computes the plates' irradiance, and passes the segments between them on.
void Flicker::pass_on(TimeNs watermark, const Workers& workers, const Take& take) {
  struct Piece {
    std::size_t plate;
    Rows rows;
  };
  std::vector<Piece> pieces;
  divided_.clear();
  for (std::size_t k = 0; k < plates_.size(); ++k) {
    const Segment& segment = segments_[plates_[k].segment];
    const Tile& tile = segment.tile;
    const int rows = std::max(1, kPixelsPerPiece / std::max(1, tile.width)), end = tile.y + tile.height;
    for (int y = tile.y; y < end; y += rows) pieces.push_back({k, {y, std::min(y + rows, end)}});
    const ImageView<float> irradiance(memory_.data() + plates_[k].pixels, tile);
    if (segment.t0 == segment.t1) divided_.push_back({tile, segment.t0, segment.t1, irradiance, irradiance});
    if (k == 0 || plates_[k - 1].segment != plates_[k].segment) continue;
    const ImageView<float> before(memory_.data() + plates_[k - 1].pixels, tile);
    divided_.push_back({tile, plates_[k - 1].t, plates_[k].t, before, irradiance});
  }
  workers.for_each(static_cast<int>(pieces.size()), [&](int i) {
    const Piece& piece = pieces[static_cast<std::size_t>(i)];
    for (int y = piece.rows.first; y < piece.rows.last; ++y) fill(piece.plate, y);
  });
  if (!divided_.empty()) take(divided_, watermark);
  plates_.clear(), memory_.clear(), factors_.clear();
}

/// Computes a row of a plate.
void Flicker::fill(std::size_t plate, int y) {
  const auto& [i, first, t] = plates_[plate];
  const Segment& segment = segments_[i];
  const Tile& tile = segment.tile;
  const auto width = static_cast<std::size_t>(tile.width);
  float* const out = memory_.data() + first + static_cast<std::size_t>(y - tile.y) * width;
  const float* const e0 = segment.irradiance0.row(y) + tile.x;
  const float* const e1 = segment.irradiance1.row(y) + tile.x;
  const float* const factors = factors_.data() + plate * light_.lights();
  const bool one_light = ends_[i].lights.size() == 1;
  const float factor = one_light ? factors[ends_[i].lights[0]] : 1.0F;
  const float s =
      segment.t0 == segment.t1
          ? 0.0F
          : static_cast<float>(static_cast<double>(t - segment.t0) / static_cast<double>(segment.t1 - segment.t0));
  if (t == segment.t0) {
    scale(width, e0, factor, out);
  } else if (t == segment.t1) {
    scale(width, e1, factor, out);
  } else {
    interpolate(width, e0, e1, s, dark_, factor, out);
  }
  if (one_light) return;
  const std::uint16_t* const before = ends_[i].before.row(y) + tile.x;
  const std::uint16_t* const after = ends_[i].after.row(y) + tile.x;
  for (std::size_t x = 0; x < width; ++x) {
    const std::size_t light0 = light_.light_of(before[x]), light1 = light_.light_of(after[x]);
    if (light0 == light1) {
      out[x] *= factors[light0];
    } else {
      out[x] = (1 - s) * factors[light0] * e0[x] + s * factors[light1] * e1[x];
    }
  }
}

// --- images ----------------------------------------------------------------------------------------------------------

void Flicker::illuminate(TimeNs t, const Image<std::uint16_t>& object, Image<float>& irradiance) const {
  std::vector<float> factors;
  for (std::size_t light = 0; light < light_.lights(); ++light)
    factors.push_back(static_cast<float>(light_.at_of_light(t, light)));
  const std::span<float> pixels = irradiance.pixels();
  for (std::size_t i = 0; i < pixels.size(); ++i)
    pixels[i] *= factors[light_.has_sources() ? light_.light_of(object.pixels()[i]) : 0];
}

}  // namespace esim::inline light
