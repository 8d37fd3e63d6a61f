#include "esim/backends/opengl/gl_shaders.h"

namespace esim::inline backends::inline opengl {

const char* const kGlossyDefinition = R"(
#define GLOSSY
)";

// The model of backends/raycast/glossy_light.h and glossy_surface.h, and the look-ups of scene/environment.
const char* const kGlossyShader = R"(
struct Area {
  vec4 centre;     // w: number of samples along each side
  vec4 half_u;     // w: strength of a sample
  vec4 half_v;     // w: area of a sample's part, m^2
  vec4 direction;  // in which it shines
};
layout(std430, binding = 3) readonly buffer Areas { Area areas[]; };
layout(std430, binding = 4) readonly buffer Surroundings { float values[]; };  // the split sum, then the environment
layout(binding = 4) uniform sampler2D metallic_texture;
layout(binding = 5) uniform sampler2D roughness_texture;
layout(binding = 6) uniform sampler2D normal_x;
layout(binding = 7) uniform sampler2D normal_y;
layout(binding = 8) uniform sampler2D normal_z;
uniform bool has_metallic_texture;
uniform bool has_roughness_texture;
uniform bool has_normal_textures;
uniform float metallic;
uniform float roughness;
uniform float reflectance;
uniform float edge_reflectance;
uniform int area_count;
uniform bool has_environment;
uniform ivec2 maps[10];  // of the environment: size, and place among the values; for diffuse light, then the lobes
uniform mat3 world_from_view;

const int kSplitSum = 64;       // as SplitSum::kSize
const float kSmoothest = 0.03;  // as in glossy_surface.h

struct Surface {
  vec3 normal, view;
  float cosine_view, alpha2, roughness, metallic;
};

// The surface's parameters. A relief is bent in the frame of the texture; see texture_frame.h.
Surface surface_at(vec3 n, vec3 flat_normal, vec3 right, vec3 down) {
  Surface s;
  s.metallic = metallic * (has_metallic_texture ? mean_colour(metallic_texture) : 1.0);
  float rough = max(kSmoothest, roughness * (has_roughness_texture ? mean_colour(roughness_texture) : 1.0));
  float widening = 0;
  if (has_normal_textures) {
    vec3 m = 2 * vec3(mean_colour(normal_x), mean_colour(normal_y), mean_colour(normal_z)) - 1;
    float size = min(length(m), 1.0);
    // The derivatives of the point by the texture coordinates, from those of both by the pixel.
    vec2 a = dFdx(uv), b = dFdy(uv);
    float area = a.x * b.y - a.y * b.x;
    if (size > 1e-3 && area != 0) {
      vec3 along_u = (b.y * right - a.y * down) / area, along_v = (a.x * down - b.x * right) / area;
      vec3 t = normalize(along_u - dot(along_u, n) * n), across = cross(n, t);
      if (dot(across, along_v) > 0) across = -across;
      float side = gl_FrontFacing ? -1.0 : 1.0;  // images are not flipped, so that corners run the other way around
      n = normalize(side * (m.x * t + m.y * across) + m.z * n);
      widening = 2 * (1 - size) / size;
    }
  }
  s.normal = n;
  s.view = -normalize(point);
  s.cosine_view = clamp(dot(n, s.view), 1e-3, 1.0);
  s.alpha2 = min(rough * rough * rough * rough + widening, 1.0);
  s.roughness = sqrt(sqrt(s.alpha2));
  return s;
}

// What light of irradiance 1 on a surface that faces it adds to the factor on the base colour (x), and besides (y).
vec2 reflection(Surface s, vec3 to_light, float widening) {
  vec3 l = normalize(to_light), h = l + s.view;
  float n_l = max(dot(s.normal, l), 0), n_v = s.cosine_view;
  float h2 = max(dot(h, h), 1e-12), v_h = 0.5 * sqrt(h2);
  vec3 c = cross(s.normal, h);
  float sine2 = min(dot(c, c) / h2, 1), a2 = min(s.alpha2 + widening, 1);
  float spread = a2 * (1 - sine2) + sine2;
  float visibility = 0.5 / (n_l * sqrt(a2 + (1 - a2) * n_v * n_v) + n_v * sqrt(a2 + (1 - a2) * n_l * n_l));
  float lobe = n_l * a2 / (spread * spread) * visibility;
  float off = 1 - min(v_h, 1), schlick = off * off * off * off * off;
  float fresnel = reflectance + (edge_reflectance - reflectance) * schlick;
  return vec2((1 - s.metallic) * n_l * (1 - fresnel) + s.metallic * lobe * (1 - schlick),
              lobe * ((1 - s.metallic) * fresnel + s.metallic * schlick));
}

vec2 reflection_of_area(Surface s, Area area) {
  vec2 sum = vec2(0);
  float n = area.centre.w;
  for (float j = 0; j < n; ++j) {
    for (float i = 0; i < n; ++i) {
      vec2 at = 2 * (vec2(i, j) + 0.5) / n - 1;
      vec3 to_light = area.centre.xyz + at.x * area.half_u.xyz + at.y * area.half_v.xyz - point;
      float squared = max(dot(to_light, to_light), 1e-6);
      float cosine = max(-dot(area.direction.xyz, to_light), 0) * inversesqrt(squared);
      if (cosine > 0)
        sum += area.half_u.w * cosine / squared * reflection(s, to_light, 0.125 * area.half_v.w * cosine / squared);
    }
  }
  return sum;
}

// The bilinear interpolation of octahedral_map.h.
float value_of(ivec2 map, vec3 d) {
  vec3 o = d / (abs(d.x) + abs(d.y) + abs(d.z));
  vec2 sign = vec2(o.x < 0 ? -1 : 1, o.y < 0 ? -1 : 1);
  vec2 place = 0.5 + 0.5 * (o.z < 0 ? sign * (1 - abs(o.yx)) : o.xy);
  vec2 at = clamp(place * float(map.x) + 0.5, 0, float(map.x) + 0.5), f = fract(at);
  ivec2 corner = ivec2(at);
  int row = map.x + 2, first = map.y + corner.y * row + corner.x;
  return mix(mix(values[first], values[first + 1], f.x), mix(values[first + row], values[first + row + 1], f.x), f.y);
}

vec2 split_sum(float cosine, float rough) {
  vec2 at = vec2(cosine, rough) * float(kSplitSum - 1);
  ivec2 corner = min(ivec2(at), kSplitSum - 2);
  vec2 f = at - vec2(corner);
  int first = 2 * (corner.y * kSplitSum + corner.x), row = 2 * kSplitSum;
  vec2 above = mix(vec2(values[first], values[first + 1]), vec2(values[first + 2], values[first + 3]), f.x);
  first += row;
  vec2 below = mix(vec2(values[first], values[first + 1]), vec2(values[first + 2], values[first + 3]), f.x);
  return mix(above, below, f.y);
}

// Of light from everywhere: `diffuse` is what a diffuse surface receives, `lobe` what arrives in the lobe.
vec2 reflection_of_surroundings(Surface s, float diffuse, float lobe) {
  vec2 split = split_sum(s.cosine_view, s.roughness);
  float dielectric = reflectance * split.x + edge_reflectance * split.y;
  return vec2((1 - s.metallic) * diffuse * (1 - dielectric) + s.metallic * lobe * split.x,
              lobe * ((1 - s.metallic) * dielectric + s.metallic * split.y));
}

vec2 reflected() {
  vec3 right = dFdx(point), down = dFdy(point), flat_normal = normalize(cross(right, down));
  vec3 n = dot(surface_normal, surface_normal) > 0 ? normalize(surface_normal) : flat_normal;
  if (dot(flat_normal, point) > 0) flat_normal = -flat_normal;
  if (dot(n, flat_normal) < 0) n = -n;
  Surface s = surface_at(n, flat_normal, right, down);
  vec2 sum = vec2(0);
  for (int i = 0; i < light_count; ++i) {
    vec3 to_light = lights[i].place.xyz - lights[i].place.w * point;
    float squared = max(dot(to_light, to_light), 1e-6);
    float received = lights[i].strength.x * (lights[i].place.w > 0 ? 1 / squared : 1.0);
    vec2 part = received * reflection(s, to_light, 0);
#ifdef SHADOWS
    if (part.x + part.y > 0) part *= visible_fraction(i, lights[i].place.w > 0, to_light, Seen(point, right, down, flat_normal));
#endif
    sum += part;
  }
  for (int i = 0; i < area_count; ++i) sum += reflection_of_area(s, areas[i]);
  if (has_environment) {
    float alpha = sqrt(s.alpha2), lean = (1 - alpha) * (sqrt(1 - alpha) + alpha);
    vec3 mirrored = world_from_view * mix(s.normal, reflect(-s.view, s.normal), lean);
    float level = s.roughness * 8;
    int finer = min(int(level), 7);
    float lobe = mix(value_of(maps[finer + 1], mirrored), value_of(maps[finer + 2], mirrored), level - float(finer));
    sum += reflection_of_surroundings(s, value_of(maps[0], world_from_view * s.normal), lobe);
  }
  return ambient > 0 ? sum + reflection_of_surroundings(s, ambient, ambient) : sum;
}
)";

// The derivatives of scene/images/equirectangular.h.
const char* const kSkyFragmentShader = R"(
layout(binding = 9) uniform sampler2D sky;
uniform mat3 image_from_camera;
uniform vec4 pinhole;  // of the image that is drawn: fx, fy, cx, cy, px
layout(location = 0) out vec4 seen;
layout(location = 1) out uint which;
void main() {
  const float pi = 3.14159265358979;
  vec2 bearing = (gl_FragCoord.xy - 0.5 - pinhole.zw) / pinhole.xy;
  vec3 d = image_from_camera * vec3(bearing, 1);
  vec3 right = image_from_camera[0] / pinhole.x, down = image_from_camera[1] / pinhole.y;
  float rho2 = max(d.x * d.x + d.y * d.y, 1e-12), rho = sqrt(rho2);
  vec2 at = 0.5 - vec2(atan(d.y, d.x) / (2 * pi), atan(d.z, rho) / pi);
  vec3 du = vec3(d.y, -d.x, 0) / (2 * pi * rho2);
  vec3 dv = vec3(d.z * d.x / rho, d.z * d.y / rho, -rho) / (pi * (rho2 + d.z * d.z));
  float light = mean_over(sky, at, vec2(dot(du, right), dot(dv, right)), vec2(dot(du, down), dot(dv, down)));
  seen = vec4(light, 0, 0, 0);
  which = 0;
}
)";

}  // namespace esim::inline backends::inline opengl
