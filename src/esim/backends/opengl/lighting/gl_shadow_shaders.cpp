#include "esim/backends/opengl/gl_shaders.h"

namespace esim::inline backends::inline opengl {

// A light's view: depth in clip space, reversed like the camera's. Both sides of a triangle cast shadows.
const char* const kShadowMapVertexShader = R"(
layout(location = 0) in vec3 position;
uniform mat4 clip_from_object;
void main() { gl_Position = clip_from_object * vec4(position, 1); }
)";

const char* const kShadowMapFragmentShader = R"(
void main() {}
)";

// The fraction of a light that reaches a pixel's surface: percentage-closer filtering over the pixel's footprint in the
// map, and over at least three texels. Each texel's depth is compared with that of the surface's own plane under the
// texel's centre, so that no plane shadows itself at any angle; or with the surface's depth at the pixel's centre if
// that is nearer to the light, so that the other side of a concave corner casts no false shadow either. (Shadow casters
// are drawn with an offset by their own slope; see GlShadows.)
const char* const kShadowShader = R"(
#define SHADOWS
struct ShadowView {
  mat4 clip_from_camera, camera_from_clip;
  vec4 texel;  // x: its width in m at w = 1 of clip space; y: 0 if nothing has been drawn
};
layout(std430, binding = 2) readonly buffer ShadowViews {
  ShadowView views[];  // one per layer: of static objects, then of moving ones
};
layout(binding = 2) uniform sampler2DArray still_shadows;
layout(binding = 3) uniform sampler2DArray moving_shadows;
uniform int shadow_layers;
uniform int shadow_suns;          // suns come first, with one layer each; point lights have six
uniform mat3 world_from_camera;
uniform float camera_to_origin;   // of the world: |x| + |y| + |z|

// The view of a point light, out of six, that contains a direction in the world frame.
int face_of(vec3 direction) {
  vec3 size = abs(direction);
  int axis = size.x >= size.y && size.x >= size.z ? 0 : (size.y >= size.z ? 1 : 2);
  return 2 * axis + (direction[axis] < 0 ? 1 : 0);
}

// What a pixel sees: a point, its derivatives by the pixel to the right and downwards, and the triangle's normal on the
// visible side.
struct Seen {
  vec3 point, right, down, normal;
};

// A surface in a shadow map. Positions are in texels.
struct Mapped {
  vec2 place, along, across;  // of the pixel's centre, and its derivatives by the pixel to the right and downwards
  float depth;                // there
  vec2 slope;                 // how the depth changes per texel
};

// Whether light reaches each of the four texels around `corner` + 1/2: (0, 1), (1, 1), (1, 0) and (0, 0) from `corner`.
// `depth` is that of the surface nearby.
vec4 lit_texels(sampler2DArray depths, int layer, vec2 corner, Mapped seen, float depth) {
  vec4 stored = textureGather(depths, vec3((corner + 1) / vec2(textureSize(depths, 0).xy), layer));
  vec2 away = corner - seen.place;
  vec4 on_plane = seen.depth + seen.slope.x * (away.x + vec4(0, 1, 1, 0)) + seen.slope.y * (away.y + vec4(1, 1, 0, 0));
  return vec4(lessThanEqual(stored, max(max(on_plane, depth), 0)));
}

// The lit fraction of a box of 3 x 3 texels, out of 4 x 4, that moves continuously with `place`.
float fraction_of_box(sampler2DArray depths, int layer, vec2 place, Mapped seen) {
  float depth = seen.depth + dot(seen.slope, place - seen.place);
  vec2 corner = floor(place) - 1, f = fract(place);
  float sum = 0;
  for (int j = 0; j < 2; ++j) {
    for (int i = 0; i < 2; ++i) {
      vec4 lit = lit_texels(depths, layer, corner + 2 * vec2(i, j), seen, depth);
      vec2 column = i == 0 ? vec2(1 - f.x, 1) : vec2(1, f.x), row = j == 0 ? vec2(1 - f.y, 1) : vec2(1, f.y);
      sum += dot(lit, column.xyyx * row.yyxx);
    }
  }
  return sum / 9;
}

// The lit fraction of the footprint, by as many boxes as necessary, up to 4 x 4. If its corners and its centre agree,
// no straight edge crosses it.
float fraction_of_footprint(sampler2DArray depths, int layer, Mapped seen) {
  const float max_boxes = 4;
  vec2 low = vec2(1), high = vec2(textureSize(depths, 0).xy) - 3;
  vec2 boxes = clamp(ceil(vec2(length(seen.along), length(seen.across)) / 3 - 0.25), 1, max_boxes);
  if (boxes.x * boxes.y > 1) {
    float alike = 0;
    for (int i = 0; i < 5; ++i) {
      vec2 off = i == 4 ? vec2(0) : vec2(i % 2, i / 2) - 0.5;
      vec2 place = clamp(seen.place + off.x * seen.along + off.y * seen.across, low, high);
      float depth = seen.depth + dot(seen.slope, place - seen.place);
      alike += dot(lit_texels(depths, layer, floor(place), seen, depth), vec4(0.05));
    }
    if (alike < 0.01 || alike > 0.99) return round(alike);
  }
  float sum = 0;
  for (float j = 0; j < boxes.y; ++j) {
    for (float i = 0; i < boxes.x; ++i) {
      vec2 off = vec2(i + 0.5, j + 0.5) / boxes - 0.5;
      vec2 place = clamp(seen.place + off.x * seen.along + off.y * seen.across, low, high);
      sum += fraction_of_box(depths, layer, place, seen);
    }
  }
  return sum / (boxes.x * boxes.y);
}

float fraction_in_view(sampler2DArray depths, int layer, int view, Seen seen) {
  if (views[view].texel.y == 0) return 1;
  // Slightly above the surface: by a quarter of a texel plus the rounding error of the point.
  mat4 clip_from_camera = views[view].clip_from_camera;
  float texel = views[view].texel.x * (clip_from_camera * vec4(seen.point, 1)).w;
  vec3 a = abs(seen.point), n = seen.normal;
  vec3 p = seen.point + (0.25 * texel + 2e-5 * (a.x + a.y + a.z + camera_to_origin)) * n;
  vec4 clip = clip_from_camera * vec4(p, 1);
  if (clip.w <= 0) return 1;
  vec3 at = clip.xyz / clip.w;

  // Its position in the map, and the pixel's footprint there, in texels.
  vec2 size = vec2(textureSize(depths, 0).xy), half_size = 0.5 * size / clip.w;
  vec2 place = (0.5 * at.xy + 0.5) * size - 0.5;
  vec4 right = clip_from_camera * vec4(seen.right, 0), down = clip_from_camera * vec4(seen.down, 0);
  vec2 along = half_size * (right.xy - right.w * at.xy), across = half_size * (down.xy - down.w * at.xy);
  vec2 reach = 0.5 * (abs(along) + abs(across));
  if (any(lessThan(place + reach, vec2(0))) || any(greaterThan(place - reach, size - 1))) return 1;

  // The surface's plane in clip space, solved for depth: its slope per texel.
  vec4 plane = vec4(n, -dot(n, p)) * views[view].camera_from_clip;
  if (plane.z == 0) return 0;
  vec2 slope = -2 / size * plane.xy / plane.z;

  return fraction_of_footprint(depths, layer, Mapped(place, along, across, at.z, slope));
}

float visible_fraction(int light, bool is_point, vec3 to_light, Seen seen) {
  if (dot(seen.normal, to_light) <= 0) return 0;
  int layer = is_point ? shadow_suns + 6 * (light - shadow_suns) + face_of(world_from_camera * -to_light) : light;
  float still = fraction_in_view(still_shadows, layer, layer, seen);
  return still > 0 ? min(still, fraction_in_view(moving_shadows, layer, shadow_layers + layer, seen)) : 0;
}
)";

}  // namespace esim::inline backends::inline opengl
