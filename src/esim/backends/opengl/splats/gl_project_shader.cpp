#include "esim/backends/opengl/splats/gl_splat_shaders.h"

namespace esim::inline backends::inline opengl {

// The equations are those of backends/splats, which explains them: projection.cpp, lens_lanes.h and harmonics.h.
const char* const kProjectShader = R"(
layout(local_size_x = kGroup) in;
layout(std430, binding = 0) readonly restrict buffer Splats { vec4 splats[]; };
layout(std430, binding = 1) readonly restrict buffer Harmonics { uint harmonics[]; };
layout(std430, binding = 2) writeonly restrict buffer OnScreen { vec4 on_screen[]; };
layout(std430, binding = 3) writeonly restrict buffer Boxes { uvec2 boxes[]; };
layout(std430, binding = 4) writeonly restrict buffer Orders { uint orders[]; };
layout(std430, binding = 5) writeonly restrict buffer Values { uint values[]; };

// The object
uniform uint first, count;  // of its splats
uniform int degree;
uniform float variance, object;
uniform bool compensated;
uniform mat3 R_camera_group;
uniform vec3 position, position_remainder;

// The camera
uniform ivec2 size;
uniform vec2 focal, principal, limit;
uniform float domain, lens[5];
uniform bool by_depth;

float log2_of(float x) {
  int bits = floatBitsToInt(x);
  float m = intBitsToFloat((bits & 0x007fffff) | 0x3f800000) - 1;
  float q = fma(fma(fma(fma(0.02584142, m, -0.0959564), m, 0.18194884), m, -0.2756003), m, 0.44254494);
  return float((bits >> 23) - 127) + fma(m * (1 - m), q, m);
}

float arc_tangent(float t) {
  float r = t > 1 ? 1 / t : t, s = r * r;
  float angle = 0.0028662257;
  angle = fma(angle, s, -0.0161657367);
  angle = fma(angle, s, 0.0429096138);
  angle = fma(angle, s, -0.0752896400);
  angle = fma(angle, s, 0.1065626393);
  angle = fma(angle, s, -0.1420889944);
  angle = fma(angle, s, 0.1999355085);
  angle = fma(angle, s, -0.3333314528);
  angle = fma(angle, s, 1.0) * r;
  return t > 1 ? 1.57079632679 - angle : angle;
}

vec2 distorted(vec2 ideal) {
#if LENS == 2
  float r2 = dot(ideal, ideal);
  float radial = fma(fma(fma(lens[4], r2, lens[1]), r2, lens[0]), r2, 1.0);
  vec2 with = vec2(lens[2], lens[3]);
  return ideal * radial + 2 * with * ideal.x * ideal.y + with.yx * (2 * ideal * ideal + r2);
#elif LENS == 3
  float r = length(ideal), theta = arc_tangent(r), t2 = theta * theta;
  float p = fma(fma(fma(fma(lens[3], t2, lens[2]), t2, lens[1]), t2, lens[0]), t2, 1.0);
  return ideal * (r > 1e-6 ? theta * p / r : 1.0);
#elif LENS == 4
  float r = length(ideal);
  return ideal * (r > 1e-6 ? arc_tangent(r * lens[0]) * lens[1] / r : lens[0] * lens[1]);
#else
  return ideal;
#endif
}

vec2 pixel_of(vec3 point) {
  vec2 bearing = point.xy / max(point.z, kNearest);
  bearing *= domain / max(length(bearing), domain);
  return focal * distorted(bearing) + principal;
}

// The shape of a splat in the image: its centre, and columns of a root of its covariance.
#if LENS == 0
#define COLUMNS 3
vec2 project(vec3 mean, mat3 axes, out vec2 columns[COLUMNS]) {
  float inverse = 1 / max(mean.z, kNearest);
  vec2 bearing = mean.xy * inverse, at = clamp(bearing, -limit, limit);
  for (int i = 0; i < 3; ++i) columns[i] = focal * inverse * (axes[i].xy - at * axes[i].z);
  return focal * bearing + principal;
}
#else
#define COLUMNS 7
vec2 project(vec3 mean, mat3 axes, out vec2 columns[COLUMNS]) {
  const float kRoot = 0.57735026919, kSide = 1.73205080757;
  vec2 centre = pixel_of(mean), shift = vec2(0), middle[3];
  for (int i = 0; i < 3; ++i) {
    vec2 a = pixel_of(mean + kSide * axes[i]), b = pixel_of(mean - kSide * axes[i]);
    columns[i] = kRoot * 0.5 * (a - b);
    middle[i] = 0.5 * (a + b) - centre;
    shift += middle[i] / 3;
  }
  for (int i = 0; i < 3; ++i) columns[3 + i] = kRoot * (middle[i] - shift);
  columns[6] = 1.41421356237 * shift;
  return centre + shift;
}
#endif

// Half float number i of splat k
float half_float(uint k, uint i) {
  vec2 pair = unpackHalf2x16(harmonics[(i >> 1) * count + k]);
  return (i & 1u) == 0 ? pair.x : pair.y;
}
vec3 coefficient(uint k, uint i) {
  return vec3(half_float(k, 3 * i - 3), half_float(k, 3 * i - 2), half_float(k, 3 * i - 1));
}

vec3 colour_of(uint k, vec3 constant, vec3 direction) {
  vec3 c = constant;
  if (degree > 0) {
    vec3 d = direction / sqrt(max(dot(direction, direction), 1e-30));
    float x = d.x, y = d.y, z = d.z;
    c += coefficient(k, 1) * (-0.4886025119 * y);
    c += coefficient(k, 2) * (0.4886025119 * z);
    c += coefficient(k, 3) * (-0.4886025119 * x);
    if (degree > 1) {
      float xx = x * x, yy = y * y, zz = z * z;
      c += coefficient(k, 4) * (1.0925484306 * x * y);
      c += coefficient(k, 5) * (-1.0925484306 * y * z);
      c += coefficient(k, 6) * (0.3153915653 * (2 * zz - xx - yy));
      c += coefficient(k, 7) * (-1.0925484306 * x * z);
      c += coefficient(k, 8) * (0.5462742153 * (xx - yy));
      if (degree > 2) {
        c += coefficient(k, 9) * (-0.5900435899 * y * (3 * xx - yy));
        c += coefficient(k, 10) * (2.8906114426 * x * y * z);
        c += coefficient(k, 11) * (-0.4570457995 * y * (4 * zz - xx - yy));
        c += coefficient(k, 12) * (0.3731763326 * z * (2 * zz - 3 * (xx + yy)));
        c += coefficient(k, 13) * (-0.4570457995 * x * (4 * zz - xx - yy));
        c += coefficient(k, 14) * (1.4453057213 * z * (xx - yy));
        c += coefficient(k, 15) * (-0.5900435899 * x * (xx - 3 * yy));
      }
    }
  }
  return max(c, vec3(0));
}

void main() {
  uint k = gl_GlobalInvocationID.x;
  if (k >= count) return;
  uint to = first + k;
  orders[to] = 0u, values[to] = 0u;

  vec4 a = splats[4 * k], b = splats[4 * k + 1], c = splats[4 * k + 2], d = splats[4 * k + 3];
  precise vec3 rough = a.xyz - position, from_camera = rough - position_remainder;
  vec3 mean = R_camera_group * from_camera;
  float opacity = a.w * clamp(mean.z * (1 / kNearest) - 1, 0.0, 1.0);
  if (!(opacity > kInvisible)) return;
  mat3 axes = R_camera_group * mat3(b.xyz, c.xyz, d.xyz);

  // The Gaussian in the image
  vec2 columns[COLUMNS];
  vec2 centre = project(mean, axes, columns);
  float xx = variance, xy = 0, yy = variance, own = 0, trace = 0;
  for (int i = 0; i < COLUMNS; ++i) {
    vec2 t = columns[i];
    xx += t.x * t.x, xy += t.x * t.y, yy += t.y * t.y, trace += dot(t, t);
    for (int j = 0; j < i; ++j) {
      float across = t.x * columns[j].y - t.y * columns[j].x;
      own += across * across;
    }
  }
  float determinant = variance * (variance + trace) + own;
  if (compensated) opacity *= sqrt(own / determinant);
  if (!(opacity > kInvisible && determinant > 0)) return;
  float z = max(mean.z, kNearest), inverse = 1 / z, scale = -0.5 * kLog2E / determinant;

  // Bins
  float peak = log2_of(opacity);
  vec2 extent = sqrt(2 / kLog2E * (peak - kLog2Invisible) * vec2(xx, yy));
  vec2 low = ceil(centre - extent), high = floor(centre + extent);
  if (!(high.x >= low.x && high.y >= low.y && high.x >= 0 && high.y >= 0 && low.x < size.x && low.y < size.y)) return;
  uvec2 from_bin = uvec2(max(low, vec2(0))) / kBin, to_bin = uvec2(min(high, vec2(size - 1))) / kBin;

  // Depth: the mean of the Gaussian at each place in the image
  vec2 zt = vec2(0);
  float thickness = 0;
  for (int i = 0; i < 3; ++i) zt += axes[i].z * columns[i], thickness += axes[i].z * axes[i].z;
  vec2 slope = -(inverse * inverse / determinant) * vec2(zt.x * yy - zt.y * xy, zt.y * xx - zt.x * xy);
  float depth_extent = 3 * sqrt(thickness);

  vec3 colour = colour_of(k, vec3(b.w, c.w, d.w), from_camera);
  on_screen[4 * to] = vec4(centre, scale * yy, -2 * scale * xy);
  on_screen[4 * to + 1] = vec4(scale * xx, peak, inverse, object);
  on_screen[4 * to + 2] = vec4(slope, 1 / (z + depth_extent), 1 / max(z - depth_extent, 0.05 * z));
  on_screen[4 * to + 3] = vec4(colour, 0);
  boxes[to] = from_bin | to_bin << 16;
  precise float distance2 = fma(from_camera.x, from_camera.x, fma(from_camera.y, from_camera.y,
                                                                  from_camera.z * from_camera.z));
  orders[to] = floatBitsToUint(by_depth ? 1 / inverse : sqrt(distance2)), values[to] = 1u;
}
)";

}  // namespace esim::inline backends::inline opengl
