#include "esim/backends/splats/projection.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>

#include "esim/backends/splats/harmonics.h"
#include "esim/backends/splats/lens_lanes.h"
#include "esim/geometry/distortion.h"
#include "esim/render/pixel_rays.h"

namespace esim::inline backends::inline splats {
namespace {

constexpr float kHuge = 32000;  // px; limit of rectangles

// Standard deviations of merged splats, px, up to which they are used alone, and from which the fine ones are
constexpr float kMergedAlone = 0.15F, kFineAlone = 0.2F;

using LaneVector = std::array<Lanes, 3>;

HWY_INLINE Lanes dot(const LaneVector& a, const LaneVector& b) {
  return hn::MulAdd(a[0], b[0], hn::MulAdd(a[1], b[1], hn::Mul(a[2], b[2])));
}

HWY_INLINE LaneVector turned(const Eigen::Matrix3f& R, const LaneVector& v) {
  const auto row = [&](int r) {
    return hn::MulAdd(all(R(r, 0)), v[0], hn::MulAdd(all(R(r, 1)), v[1], hn::Mul(all(R(r, 2)), v[2])));
  };
  return {row(0), row(1), row(2)};
}

/// The shape of splats in the image: their centres, and columns t_i of a root of their covariances, Σ_i t_i t_i^T.
template <std::size_t kColumns>
struct ImageShape {
  LanePoints centre;
  std::array<LanePoints, kColumns> columns;
};

/// A pinhole, and splats projected by its Jacobian.
struct LinearLens {
  Lanes fx, fy, cx, cy;
  Lanes limit_x, limit_y;

  HWY_INLINE ImageShape<3> shape(const LaneVector& mean, const std::array<LaneVector, 3>& axes, Lanes inverse) const {
    const Lanes x = hn::Mul(mean[0], inverse), y = hn::Mul(mean[1], inverse);
    const Lanes jx = hn::Max(hn::Min(x, limit_x), hn::Neg(limit_x)),
                jy = hn::Max(hn::Min(y, limit_y), hn::Neg(limit_y));
    ImageShape<3> shape;
    shape.centre = {hn::MulAdd(fx, x, cx), hn::MulAdd(fy, y, cy)};
    for (std::size_t i = 0; i < 3; ++i) {
      shape.columns[i] = {hn::Mul(hn::Mul(fx, inverse), hn::NegMulAdd(jx, axes[i][2], axes[i][0])),
                          hn::Mul(hn::Mul(fy, inverse), hn::NegMulAdd(jy, axes[i][2], axes[i][1]))};
    }
    return shape;
  }
};

/// The unscented transform of Wu et al., 3DGUT, 2025, with alpha = 1, beta = 2, kappa = 0: six points at sqrt(3)
/// standard deviations have the mean's weight 1/6 each, and the centre has the weight 2 in the covariance.
template <class Model>
struct UnscentedLens {
  const Model& model;
  Lanes fx, fy, cx, cy;
  float domain;

  HWY_INLINE LanePoints pixel(const LaneVector& point) const {
    const Lanes inverse = hn::Div(all(1), hn::Max(point[2], all(kNearest)));
    return pixel(LanePoints{hn::Mul(point[0], inverse), hn::Mul(point[1], inverse)});
  }

  HWY_INLINE LanePoints pixel(LanePoints bearing) const {
    const LanePoints image = distorted(model, inside(bearing, domain));
    return {hn::MulAdd(fx, image.x, cx), hn::MulAdd(fy, image.y, cy)};
  }

  HWY_INLINE ImageShape<7> shape(const LaneVector& mean, const std::array<LaneVector, 3>& axes, Lanes) const {
    const Lanes third = all(1.0F / 3), side = all(std::numbers::sqrt3_v<float>);
    const Lanes root = all(1 / std::numbers::sqrt3_v<float>), two = all(std::numbers::sqrt2_v<float>);
    const LanePoints centre = pixel(mean);
    ImageShape<7> shape;
    // Of each pair of points: half of their difference, and how far their middle is from the centre
    std::array<LanePoints, 3> middle;
    LanePoints shift{hn::Zero(kTag), hn::Zero(kTag)};
    for (std::size_t i = 0; i < 3; ++i) {
      LaneVector ahead, behind;
      for (std::size_t k = 0; k < 3; ++k) {
        ahead[k] = hn::MulAdd(side, axes[i][k], mean[k]);
        behind[k] = hn::NegMulAdd(side, axes[i][k], mean[k]);
      }
      const LanePoints a = pixel(ahead), b = pixel(behind);
      const auto half = [](Lanes x) { return hn::Mul(all(0.5F), x); };
      shape.columns[i] = {hn::Mul(root, half(hn::Sub(a.x, b.x))), hn::Mul(root, half(hn::Sub(a.y, b.y)))};
      middle[i] = {hn::Sub(half(hn::Add(a.x, b.x)), centre.x), hn::Sub(half(hn::Add(a.y, b.y)), centre.y)};
      shift = {hn::MulAdd(third, middle[i].x, shift.x), hn::MulAdd(third, middle[i].y, shift.y)};
    }
    for (std::size_t i = 0; i < 3; ++i) {
      shape.columns[3 + i] = {hn::Mul(root, hn::Sub(middle[i].x, shift.x)),
                              hn::Mul(root, hn::Sub(middle[i].y, shift.y))};
    }
    shape.columns[6] = {hn::Mul(two, shift.x), hn::Mul(two, shift.y)};
    shape.centre = {hn::Add(centre.x, shift.x), hn::Add(centre.y, shift.y)};
    return shape;
  }
};

struct LaneRect {
  Lanes left, right, top, bottom;
};

/// Stores rectangles; those of splats that are not `visible`, or whose numbers are not finite, are empty.
HWY_INLINE void keep(const LaneRect& rect, hn::Mask<LanesTag> visible, std::size_t first, ProjectedCluster& projected) {
  const Lanes high = all(kHuge), low = all(-kHuge);
  const auto ordered = hn::And(hn::Ge(hn::Sub(rect.right, rect.left), hn::Zero(kTag)),
                               hn::Ge(hn::Sub(rect.bottom, rect.top), hn::Zero(kTag)));
  const auto kept = hn::And(visible, ordered);
  const hn::RebindToSigned<LanesTag> wide;
  const hn::Rebind<std::int16_t, LanesTag> narrow;
  const auto store = [&](Lanes value, Lanes otherwise, std::int16_t* to) {
    const Lanes limited = hn::Max(hn::Min(hn::IfThenElse(kept, value, otherwise), high), low);
    hn::StoreU(hn::DemoteTo(narrow, hn::ConvertTo(wide, limited)), narrow, to + first);
  };
  store(rect.left, high, projected.left.data()), store(rect.right, low, projected.right.data());
  store(rect.top, high, projected.top.data()), store(rect.bottom, low, projected.bottom.data());
}

/// Stores splats side by side; their fields are in the order of ScreenSplat.
HWY_INLINE void keep(const std::array<Lanes, 16>& fields, ScreenSplat* splats) {
  alignas(64) std::array<std::array<float, kLanes>, 16> rows;
  for (std::size_t field = 0; field < fields.size(); ++field) hn::Store(fields[field], kTag, rows[field].data());
  for (std::size_t lane = 0; lane < static_cast<std::size_t>(kLanes); ++lane) {
    std::array<float, 16> of_lane;
    for (std::size_t field = 0; field < fields.size(); ++field) of_lane[field] = rows[field][lane];
    splats[lane] = std::bit_cast<ScreenSplat>(of_lane);
  }
}

}  // namespace

SplatView::SplatView(const RenderRequest& request, std::size_t object, const Eigen::Quaterniond& to_object) {
  SE3 T_group_camera = request.camera.T_world_body;
  if (object > 0) T_group_camera = request.objects[object - 1].T_world_body.inverse() * T_group_camera;
  T_group_camera = SE3{to_object.conjugate(), Eigen::Vector3d::Zero()} * T_group_camera;
  R_camera_group = T_group_camera.rotation.toRotationMatrix().transpose().cast<float>();
  position = T_group_camera.translation.cast<float>();
  position_remainder = (T_group_camera.translation - position.cast<double>()).cast<float>();
}

Projector::Projector(const Camera& camera, SplatProjection projection, float footprint, bool grey)
    : camera_(camera),
      linear_(projection == SplatProjection::linear ||
              (projection == SplatProjection::automatic && std::holds_alternative<NoDistortion>(camera.distortion))),
      grey_(grey),
      area_(footprint * footprint),
      domain_(static_cast<float>(domain_radius(camera.distortion))) {
  const PixelRays rays(camera);
  float largest = 0, smallest = std::numeric_limits<float>::infinity(), widest = 0;
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      Eigen::Matrix2f J;
      J << rays.dx_du(x, y), rays.dx_dv(x, y), rays.dy_du(x, y), rays.dy_dv(x, y);
      const float norm = J.norm();
      largest = std::max(largest, norm), smallest = std::min(smallest, std::abs(J.determinant()) / norm);
      limit_x_ = std::max(limit_x_, std::abs(rays.x(x, y))), limit_y_ = std::max(limit_y_, std::abs(rays.y(x, y)));
      widest = std::max(widest, std::hypot(rays.x(x, y), rays.y(x, y)));
    }
  }
  limit_x_ *= kLinearLimit, limit_y_ *= kLinearLimit;
  domain_ = std::min(domain_, kUnscentedLimit * widest);
  px_per_bearing_ = 1 / (smallest * footprint);
  margin_ = largest * (1 + kReach * std::sqrt(0.3F * area_));
  // The Jacobian of a bearing r by a point at depth Z is at most sqrt(1 + r²) / Z. Unscented points are nearer, and the
  // lens magnifies them by more than at the place where they are seen.
  reach_ = kReach * std::sqrt(1 + limit_x_ * limit_x_ + limit_y_ * limit_y_) * (linear_ ? 1 : 2 * largest / smallest);
}

void ClusterBoxes::resize(std::size_t count) {
  for (auto* of_axes : {&middle, &half}) {
    for (std::vector<float>& values : *of_axes) values.resize(count);
  }
  reach.resize(count), fine.resize(count);
}

void ClusterBoxes::append(const ClusterBoxes& other, std::size_t i) {
  for (std::size_t k = 0; k < 3; ++k) middle[k].push_back(other.middle[k][i]), half[k].push_back(other.half[k][i]);
  reach.push_back(other.reach[i]), fine.push_back(other.fine[i]);
}

void ClusterBoxes::find_visible(const BearingRect& rect, std::vector<std::uint8_t>& visible) const {
  visible.resize(size());
  const float *mx = middle[0].data(), *my = middle[1].data(), *mz = middle[2].data();
  const float *hx = half[0].data(), *hy = half[1].data(), *hz = half[2].data(), *beyond = reach.data();
  std::uint8_t* to = visible.data();
  const float left = rect.left, right = rect.right, top = rect.top, bottom = rect.bottom;
#pragma omp simd
  for (std::size_t i = 0; i < visible.size(); ++i) {
    // The planes through the camera and the sides of the rectangle
    const float l = mx[i] - left * mz[i] + hx[i] + std::abs(left) * hz[i];
    const float r = right * mz[i] - mx[i] + hx[i] + std::abs(right) * hz[i];
    const float t = my[i] - top * mz[i] + hy[i] + std::abs(top) * hz[i];
    const float b = bottom * mz[i] - my[i] + hy[i] + std::abs(bottom) * hz[i];
    const float inside = std::min(std::min(l, r), std::min(t, b)) + beyond[i];
    to[i] = static_cast<std::uint8_t>((inside >= 0) & (mz[i] + hz[i] > kNearest));
  }
}

void Projector::find_boxes(const SplatScene::Placed& group, const SplatView& view, ClusterBoxes& boxes) const {
  const std::size_t count = group.fine.clusters.size();
  boxes.resize(count);
  const float *mx = group.fine.box_middle[0].data(), *my = group.fine.box_middle[1].data(),
              *mz = group.fine.box_middle[2].data();
  const float *hx = group.fine.box_half[0].data(), *hy = group.fine.box_half[1].data(),
              *hz = group.fine.box_half[2].data();
  const float cx = view.position.x(), cy = view.position.y(), cz = view.position.z();
  for (int row = 0; row < 3; ++row) {
    const float rx = view.R_camera_group(row, 0), ry = view.R_camera_group(row, 1), rz = view.R_camera_group(row, 2);
    float* const middle = boxes.middle[static_cast<std::size_t>(row)].data();
    float* const half = boxes.half[static_cast<std::size_t>(row)].data();
#pragma omp simd
    for (std::size_t i = 0; i < count; ++i) {
      middle[i] = rx * (mx[i] - cx) + ry * (my[i] - cy) + rz * (mz[i] - cz);
      half[i] = std::abs(rx) * hx[i] + std::abs(ry) * hy[i] + std::abs(rz) * hz[i];
    }
  }
  // By the distance from the camera to the ball around the box, so that turning the camera changes nothing
  const float *fine = group.fine.largest_deviation.data(), *merged = group.merged.largest_deviation.data();
  float *reach = boxes.reach.data(), *share = boxes.fine.data();
#pragma omp simd
  for (std::size_t i = 0; i < count; ++i) {
    const float x = mx[i] - cx, y = my[i] - cy, z = mz[i] - cz;
    const float radius = std::sqrt(hx[i] * hx[i] + hy[i] * hy[i] + hz[i] * hz[i]);
    const float distance = std::max(std::sqrt(x * x + y * y + z * z) - radius, kNearest);
    const float size = px_per_bearing_ * merged[i] / distance;
    share[i] = std::min(std::max((size - kMergedAlone) * (1 / (kFineAlone - kMergedAlone)), 0.0F), 1.0F);
    reach[i] = reach_ * (share[i] < 1 ? std::max(fine[i], merged[i]) : fine[i]);
  }
}

template <class Lens>
void Projector::project_through(const Lens& lens, const SplatGroup& group, const SplatRange& cluster,
                                const SplatView& view, float share, float object, ProjectedCluster& projected) const {
  constexpr float kLog2E = std::numbers::log2e_v<float>;
  const Lanes variance = all(variance_of(group.filter) * area_), one = all(1), zero = hn::Zero(kTag);
  const bool compensated = group.filter != SplatFilter::dilated;
  for (std::size_t i = cluster.first; i < cluster.first + cluster.count; i += kLanes) {
    const auto load = [&](const SplatGroup::Column& column) { return hn::LoadU(kTag, &column[i]); };
    LaneVector from_camera;
    for (int k = 0; k < 3; ++k) {
      const auto c = static_cast<std::size_t>(k);
      const Lanes rough = hn::Sub(load(group.centre[c]), all(view.position[k]));
      from_camera[c] = hn::Sub(rough, all(view.position_remainder[k]));
    }
    const LaneVector mean = turned(view.R_camera_group, from_camera);
    std::array<LaneVector, 3> axes;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      axes[axis] = turned(view.R_camera_group,
                          {load(group.axes[axis][0]), load(group.axes[axis][1]), load(group.axes[axis][2])});
    }

    // Opacity; next to the camera, it falls to 0.
    const Lanes z = hn::Max(mean[2], all(kNearest)), inverse = hn::Div(one, z);
    Lanes opacity = load(group.opacity);
    if (share < 1) {
      const Lanes clear = hn::Max(hn::Sub(one, opacity), all(1e-6F));
      opacity = hn::Max(hn::Sub(one, exp2_of(hn::Mul(all(share), log2_of(clear)))), zero);
    }
    opacity = hn::Mul(opacity, hn::Max(zero, hn::Min(one, hn::MulSub(mean[2], all(1 / kNearest), one))));

    // The Gaussian in the image
    const auto shape = lens.shape(mean, axes, inverse);
    const auto depth_along = [&](std::size_t a) { return a < axes.size() ? axes[a][2] : zero; };
    Lanes xx = variance, xy = zero, yy = variance, own = zero, trace = zero;
    Lanes depth_x = zero, depth_y = zero;  // covariances of depth and image, times the adjugate of the covariance
    for (std::size_t a = 0; a < shape.columns.size(); ++a) {
      const auto& [tx, ty] = shape.columns[a];
      const Lanes tz = depth_along(a);
      xx = hn::MulAdd(tx, tx, xx), xy = hn::MulAdd(tx, ty, xy), yy = hn::MulAdd(ty, ty, yy);
      trace = hn::MulAdd(tx, tx, hn::MulAdd(ty, ty, trace));
      depth_x = hn::MulAdd(variance, hn::Mul(tz, tx), depth_x);
      depth_y = hn::MulAdd(variance, hn::Mul(tz, ty), depth_y);
      for (std::size_t b = 0; b < a; ++b) {  // Binet and Cauchy: exact where xx yy - xy² cancels
        const auto& [ux, uy] = shape.columns[b];
        const Lanes uz = depth_along(b), cross = hn::MulSub(tx, uy, hn::Mul(ty, ux));
        own = hn::MulAdd(cross, cross, own);
        depth_x = hn::MulAdd(cross, hn::MulSub(tz, uy, hn::Mul(uz, ty)), depth_x);
        depth_y = hn::MulAdd(cross, hn::MulSub(uz, tx, hn::Mul(tz, ux)), depth_y);
      }
    }
    const Lanes determinant = hn::MulAdd(variance, hn::Add(variance, trace), own);
    if (compensated) opacity = hn::Mul(opacity, hn::Sqrt(hn::Div(own, determinant)));
    const Lanes scale = hn::Div(all(-0.5F * kLog2E), determinant);

    // Depth, given the place in the image: the mean of the Gaussian there, with the filter's width, is linear. Its
    // inverse is continued linearly, which is exact on planes.
    Lanes thickness = zero;
    for (const LaneVector& axis : axes) thickness = hn::MulAdd(axis[2], axis[2], thickness);
    const Lanes fall = hn::Neg(hn::Div(hn::Mul(inverse, inverse), determinant));
    const Lanes right = hn::Mul(fall, depth_x), down = hn::Mul(fall, depth_y);
    const Lanes extent = hn::Mul(all(3), hn::Sqrt(thickness));
    const Lanes farthest = hn::Div(one, hn::Add(z, extent));
    const Lanes nearest = hn::Div(one, hn::Max(hn::Sub(z, extent), hn::Mul(all(0.05F), z)));

    // Rectangle: up to the opacity at which splats are invisible
    const auto visible = hn::And(hn::Gt(opacity, all(kInvisible)), hn::Gt(determinant, zero));
    const Lanes peak = log2_of(hn::Max(opacity, all(kInvisible)));
    const Lanes reach2 = hn::Mul(all(2 / kLog2E), hn::Sub(peak, all(std::log2(kInvisible))));
    const Lanes half_width = hn::Sqrt(hn::Mul(reach2, xx)), half_height = hn::Sqrt(hn::Mul(reach2, yy));

    LaneVector colour = colours_of(group, i, from_camera);
    if (grey_) {
      const auto [red, green, blue] = colour;
      colour[0] = hn::MulAdd(all(0.2126F), hn::Sub(red, green), hn::MulAdd(all(0.0722F), hn::Sub(blue, green), green));
    }
    // Without the rotation, so that turning the camera does not even change its rounding
    const Lanes distance = hn::Sqrt(dot(from_camera, from_camera));
    const LaneRect rect{hn::Ceil(hn::Sub(shape.centre.x, half_width)), hn::Floor(hn::Add(shape.centre.x, half_width)),
                        hn::Ceil(hn::Sub(shape.centre.y, half_height)),
                        hn::Floor(hn::Add(shape.centre.y, half_height))};
    keep(rect, visible, i - cluster.first, projected);
    const std::array<Lanes, 16> fields{shape.centre.x,
                                       shape.centre.y,
                                       hn::Mul(scale, yy),
                                       hn::Mul(all(-2), hn::Mul(scale, xy)),
                                       hn::Mul(scale, xx),
                                       peak,
                                       inverse,
                                       right,
                                       down,
                                       farthest,
                                       nearest,
                                       colour[0],
                                       colour[1],
                                       colour[2],
                                       all(object),
                                       distance};
    keep(fields, &projected.splats[i - cluster.first]);
  }
  projected.set_bounds(cluster.count);
}

void Projector::project(const SplatGroup& group, const SplatRange& cluster, const SplatView& view, float share,
                        float object, ProjectedCluster& projected) const {
  const Lanes fx = all(static_cast<float>(camera_.fx)), fy = all(static_cast<float>(camera_.fy));
  const Lanes cx = all(static_cast<float>(camera_.cx)), cy = all(static_cast<float>(camera_.cy));
  if (linear_) {
    return project_through(LinearLens{fx, fy, cx, cy, all(limit_x_), all(limit_y_)}, group, cluster, view, share,
                           object, projected);
  }
  std::visit(
      [&]<class Model>(const Model& model) {
        project_through(UnscentedLens<Model>{model, fx, fy, cx, cy, domain_}, group, cluster, view, share, object,
                        projected);
      },
      camera_.distortion);
}

}  // namespace esim::inline backends::inline splats
