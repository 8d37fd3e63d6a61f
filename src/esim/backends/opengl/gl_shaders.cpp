#include "esim/backends/opengl/gl_shaders.h"

namespace esim::inline backends::inline opengl {

const char* const kSeveralSamples = "#define SEVERAL_SAMPLES\n";
const char* const kDeforms = "#define DEFORMS\n";

// The motion field of render/motion_field.h, of one pixel.
const char* const kLastPassShader = R"(
#define LAST_PASS
struct Twist {
  vec4 v, omega;  // of the camera relative to the surface, in the camera frame; m/s, rad/s
};
layout(std430, binding = 1) readonly buffer Twists { Twist twists[]; };  // by object; first the static scene

// E, Z and V. `jacobian` is the derivative of the pixel's position by its bearing.
vec4 last_pass(float irradiance, float inverse_depth, uint which, vec2 bearing, mat2 jacobian) {
  float depth = inverse_depth > 0 ? 1 / inverse_depth : uintBitsToFloat(0x7F800000u);
  vec3 w = -twists[which].v.xyz * inverse_depth - cross(twists[which].omega.xyz, vec3(bearing, 1));
  return vec4(irradiance, depth, jacobian * (w.xy - bearing * w.z));
}
)";

// Row y of a target is row y of the image: images are not flipped. Depth is reversed (1 at the near plane, 0 at
// infinity), so that floats stay precise at large distances; 1 / gl_FragCoord.w is Z.
const char* const kSurfaceVertexShader = R"(
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec2 texture_uv;
uniform mat4 camera_from_object;
uniform vec4 clip;  // clip coordinates x, y = (clip.xy) X, Y + (clip.zw) Z
uniform float near;
out vec3 point;  // in the camera frame
out vec3 surface_normal;
out vec2 uv;
#ifdef DEFORMS
out vec2 barycentric;
#endif
void main() {
#ifdef DEFORMS
  int corner = gl_VertexID % 3;
  barycentric = vec2(corner == 1, corner == 2);
#endif
  point = (camera_from_object * vec4(position, 1)).xyz;
  surface_normal = mat3(camera_from_object) * normal;
  uv = texture_uv;
  gl_Position = vec4(clip.xy * point.xy + clip.zw * point.z, near, point.z);
}
)";

const char* const kMeanShader = R"(
// Mean over the pixel's footprint, a parallelogram with the sides dx and dy, by probes on one level of the mip pyramid.
// In squares of widths, which are 12 times the variance, its texels average over 1 and their interpolation over 2; that
// of level 0 belongs to the image. The probes supply the rest: n of them at a distance s have the square width
// (n^2 - 1) s^2. The anisotropic filters of drivers differ.
float mean_over(sampler2D image, vec2 uv, vec2 dx, vec2 dy) {
  vec2 size = vec2(textureSize(image, 0));
  vec2 sides = clamp(vec2(length(dx * size), length(dy * size)), 1e-6, 1e6);
  float major = max(sides.x, sides.y), minor = min(sides.x, sides.y);
  float level = clamp(floor(log2(max(minor / 2, major / 8))), 0, float(textureQueryLevels(image) - 1));
  float texel = exp2(level), blur = 3 * (1 - 1 / (texel * texel));
  vec2 widths = sqrt(max(sides * sides / (texel * texel) - blur, 0));
  vec2 probes = min(ceil(widths) + 1, 17);
  vec2 distances = widths / sqrt(max(probes * probes - 1, 1)) * texel / sides;  // in sides
  float sum = 0;
  for (float j = 0; j < probes.y; ++j) {
    vec2 row = uv + (j - 0.5 * (probes.y - 1)) * distances.y * dy;
    for (float i = 0; i < probes.x; ++i)
      sum += textureLod(image, row + (i - 0.5 * (probes.x - 1)) * distances.x * dx, level).r;
  }
  return sum / (probes.x * probes.y);
}
)";

const char* const kSurfaceFragmentShader = R"(
struct Light {
  vec4 place;     // xyz: direction to a sun, or position of a point light (w = 1), in the camera frame
  vec4 strength;  // x
};
layout(std430, binding = 0) readonly buffer Lights { Light lights[]; };
in vec3 point;
in vec3 surface_normal;
in vec2 uv;
layout(binding = 0) uniform sampler2D base_texture;
layout(binding = 1) uniform sampler2D emission_texture;
uniform float base;
uniform float emission;
uniform bool has_base_texture;
uniform bool has_emission_texture;
uniform bool lit;
uniform float ambient;
uniform int light_count;
uniform uint object;
layout(location = 0) out vec4 seen;
layout(location = 1) out uint which;
#ifdef DEFORMS
in vec2 barycentric;
uniform int first_triangle;  // of what is drawn, in the object
layout(location = 2) out vec4 place;
#endif

float mean_colour(sampler2D image) { return mean_over(image, uv, dFdx(uv), dFdy(uv)); }

#ifndef GLOSSY
float light_on_surface() {
  // On the visible side. A vertex normal of zero means a flat triangle.
  vec3 right = dFdx(point), down = dFdy(point), flat_normal = normalize(cross(right, down));
  vec3 n = dot(surface_normal, surface_normal) > 0 ? normalize(surface_normal) : flat_normal;
  if (dot(flat_normal, point) > 0) flat_normal = -flat_normal;
  if (dot(n, flat_normal) < 0) n = -n;
  float sum = ambient;
  for (int i = 0; i < light_count; ++i) {
    vec3 to_light = lights[i].place.xyz - lights[i].place.w * point;
    float distance2 = dot(to_light, to_light);
    float fall_off = lights[i].place.w > 0 ? 1 / distance2 : 1.0;
    float received = lights[i].strength.x * fall_off * max(dot(n, to_light) * inversesqrt(distance2), 0);
#ifdef SHADOWS
    if (received > 0) received *= visible_fraction(i, lights[i].place.w > 0, to_light, Seen(point, right, down, flat_normal));
#endif
    sum += received;
  }
  return sum;
}
#else
vec2 reflected();
#endif

void main() {
  float colour = base * (has_base_texture ? mean_colour(base_texture) : 1.0);
#ifdef GLOSSY
  if (lit) {
    vec2 light = reflected();
    colour = colour * light.x + light.y;
  }
#else
  if (lit) colour *= light_on_surface();
#endif
  colour += emission * (has_emission_texture ? mean_colour(emission_texture) : 1.0);
  float w = gl_FragCoord.w;
  seen = vec4(colour, w, dFdx(w), dFdy(w));
  which = object;
#ifdef DEFORMS
  place = vec4(float(first_triangle + gl_PrimitiveID), barycentric, 0);
#endif
}
)";

const char* const kWholeImageVertexShader = R"(
void main() {
  gl_Position = vec4(gl_VertexID == 1 ? 3 : -1, gl_VertexID == 2 ? 3 : -1, 0, 1);
}
)";

// E is the mean of the samples; Z and the object are those of one sample.
const char* const kResolveFragmentShader = R"(
#ifdef SEVERAL_SAMPLES
layout(binding = 0) uniform sampler2DMS seen_samples;
layout(binding = 1) uniform usampler2DMS which_samples;
#ifdef DEFORMS
layout(binding = 6) uniform sampler2DMS place_samples;
#endif
#else
layout(binding = 0) uniform sampler2D seen_samples;
layout(binding = 1) uniform usampler2D which_samples;
#ifdef DEFORMS
layout(binding = 6) uniform sampler2D place_samples;
#endif
#endif
uniform int samples;
uniform vec4 pinhole;  // fx, fy, cx, cy, px
layout(location = 0) out vec4 seen;
layout(location = 1) out uint which;
#ifdef DEFORMS
layout(location = 2) out vec4 place;
#endif
void main() {
  ivec2 pixel = ivec2(gl_FragCoord.xy);
#ifdef DEFORMS
  place = texelFetch(place_samples, pixel, 0);
#endif
  vec4 first = texelFetch(seen_samples, pixel, 0);
  for (int i = 1; i < samples; ++i) first.r += texelFetch(seen_samples, pixel, i).r;
  first.r /= float(samples);
  which = texelFetch(which_samples, pixel, 0).r;
#ifdef LAST_PASS
  vec2 bearing = (vec2(pixel) - pinhole.zw) / pinhole.xy;
  seen = last_pass(first.r, first.g, which, bearing, mat2(pinhole.x, 0, 0, pinhole.y));
#else
  seen = first;
#endif
}
)";

// Tables hold each pixel's centre and footprint in the pinhole image, its bearing and the Jacobian of the lens. 1 / Z
// is linear on planes, so that Z is exact there.
const char* const kDistortFragmentShader = R"(
layout(binding = 0) uniform sampler2D pinhole_seen;
layout(binding = 1) uniform usampler2D pinhole_which;
layout(binding = 2) uniform sampler2D centres;     // of each pixel, in pixels of the pinhole image
layout(binding = 3) uniform sampler2D footprints;  // dx/du, dx/dv, dy/du, dy/dv
layout(binding = 4) uniform sampler2D bearings;
layout(binding = 5) uniform sampler2D jacobians;   // of the pixel by the bearing: du/dx, dv/dx, du/dy, dv/dy
layout(location = 0) out vec4 seen;
layout(location = 1) out uint which;
#ifdef DEFORMS
layout(binding = 6) uniform sampler2D pinhole_place;
layout(location = 2) out vec4 place;
#endif

float irradiance(vec2 at) {
  ivec2 corner = ivec2(floor(at));
  vec2 f = at - vec2(corner);
  float upper = mix(texelFetch(pinhole_seen, corner, 0).r, texelFetch(pinhole_seen, corner + ivec2(1, 0), 0).r, f.x);
  float lower = mix(texelFetch(pinhole_seen, corner + ivec2(0, 1), 0).r,
                    texelFetch(pinhole_seen, corner + ivec2(1, 1), 0).r, f.x);
  return mix(upper, lower, f.y);
}

void main() {
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  vec2 centre = texelFetch(centres, pixel, 0).rg;
  vec4 footprint = texelFetch(footprints, pixel, 0);
  vec2 right = 0.25 * footprint.xz, down = 0.25 * footprint.yw;
  float sum = irradiance(centre - right - down) + irradiance(centre + right - down) +
              irradiance(centre - right + down) + irradiance(centre + right + down);
  ivec2 nearest = ivec2(floor(centre + 0.5));
  vec4 there = texelFetch(pinhole_seen, nearest, 0);
  float inverse_depth = max(there.g + dot(there.ba, centre - vec2(nearest)), 0);
  vec4 jacobian = texelFetch(jacobians, pixel, 0);
  which = texelFetch(pinhole_which, nearest, 0).r;
#ifdef DEFORMS
  place = texelFetch(pinhole_place, nearest, 0);
#endif
  seen = last_pass(0.25 * sum, inverse_depth, which, texelFetch(bearings, pixel, 0).rg,
                   mat2(jacobian.xy, jacobian.zw));
}
)";

}  // namespace esim::inline backends::inline opengl
