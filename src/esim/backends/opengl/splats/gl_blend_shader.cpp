#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "esim/backends/opengl/splats/gl_splat_shaders.h"
#include "esim/scene/planes.h"
#include "esim/scene/splats/splat_rules.h"

namespace esim::inline backends::inline opengl {

std::string gl_splat_rules() {
  std::string text;
  for (const auto& [name, value] : {std::pair("kGroup", kGlGroup), std::pair("kBlock", kGlBlock),
                                    std::pair("kDigits", 1U << kGlMaxBits), std::pair("kBin", GLuint{kGlBin})})
    text += fmt::format("const uint {} = {}u;\n", name, value);
  for (const auto& [name, value] :
       {std::pair("kFadeFrom", kFadeFrom), std::pair("kInvisible", kInvisible), std::pair("kNearest", kNearest),
        std::pair("kOpaque", kOpaque), std::pair("kFinished", kFinished),
        std::pair("kLog2Invisible", std::log2(kInvisible)), std::pair("kLog2E", std::numbers::log2e_v<float>),
        std::pair("kRed", luminance(1, 0, 0)), std::pair("kBlue", luminance(0, 0, 1))})
    text += fmt::format("const float {} = {:.9e};\n", name, value);
  return text;
}

// The rules are those of backends/splats/compositor.cpp.
const char* const kBlendShader = R"(
layout(local_size_x = kBin, local_size_y = kBin) in;
layout(std430, binding = 0) readonly restrict buffer ItemsIn { uvec2 items_in[]; };
layout(std430, binding = 2) readonly restrict buffer OnScreen { vec4 on_screen[]; };
layout(std430, binding = 4) readonly restrict buffer Curve { float curve[]; };
layout(std430, binding = 5) readonly restrict buffer Ranges { uvec2 ranges[]; };
layout(std430, binding = 6) writeonly restrict buffer Image { uint image[]; };

uniform ivec2 size;
uniform float behind, gain;   // what is behind all splats, in their space; from linear light to irradiance
uniform uint curve_steps;     // of the table; 0: the light is linear
uniform float display_gamma;  // 0: the sRGB curve

struct ScreenSplat {
  vec4 place;  // x, y, and xx, xy of the exponent
  vec4 peak;   // yy, peak, nearness, object
  vec4 depth;  // slopes of the nearness, the farthest, the nearest
  vec4 colour;
};
const uint kBatch = kBin * kBin;
shared ScreenSplat batch[kBatch];
shared uint unfinished;

float linear_light(float encoded) {
  if (curve_steps == 0 || encoded <= 0) return max(encoded, 0);
  float at = encoded * float(curve_steps);
  if (at >= float(curve_steps))
    return display_gamma > 0 ? pow(encoded, display_gamma) : pow((encoded + 0.055) / 1.055, 2.4);
  uint i = uint(at);
  return curve[i] + (at - float(i)) * (curve[i + 1] - curve[i]);
}

void main() {
  uvec2 pixel = gl_GlobalInvocationID.xy;
  uvec2 range = ranges[gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x];
  bool inside = all(lessThan(pixel, uvec2(size)));
  vec3 colour = vec3(0);
  float transmittance = inside ? 1 : 0, nearness = 0, object = 0;
  for (uint start = range.x; start < range.y; start += kBatch) {
    if (gl_LocalInvocationIndex == 0) unfinished = 0;
    barrier();
    if (transmittance > kFinished) unfinished = 1;
    barrier();
    if (unfinished == 0) break;
    uint many = min(kBatch, range.y - start);
    if (gl_LocalInvocationIndex < many) {
      uint from = 4 * items_in[start + gl_LocalInvocationIndex].y;
      batch[gl_LocalInvocationIndex] =
          ScreenSplat(on_screen[from], on_screen[from + 1], on_screen[from + 2], on_screen[from + 3]);
    }
    barrier();
    for (uint i = 0; i < many; ++i) {
      vec4 place = batch[i].place, peak = batch[i].peak;
      vec2 d = vec2(pixel) - place.xy;
      float exponent = d.x * (place.z * d.x + place.w * d.y) + (peak.x * d.y * d.y + peak.y);
      if (!(exponent > kLog2Invisible && transmittance > kFinished)) continue;
      float raw = exp2(exponent);
      float fade = clamp((raw - kInvisible) * (1 / (kFadeFrom - kInvisible)), 0, 1);
      float weight = transmittance * min(raw * fade, kOpaque), after = transmittance - weight;
      colour += weight * batch[i].colour.rgb;
      if (transmittance >= 0.5 && after < 0.5) {
        vec4 depth = batch[i].depth;
        nearness = min(max(peak.z + dot(depth.xy, d), depth.z), depth.w);
        object = peak.w;
      }
      transmittance = after;
    }
    barrier();
  }
  if (!inside) return;
  vec3 c = colour + transmittance * behind;
  float red = linear_light(c.r), green = linear_light(c.g), blue = linear_light(c.b);
  uint at = pixel.y * size.x + pixel.x, pixels = size.x * size.y;
  image[at] = floatBitsToUint(gain * (green + kRed * (red - green) + kBlue * (blue - green)));
  image[pixels + at] = floatBitsToUint(nearness);
  image[2 * pixels + at] = uint(object);
}
)";

}  // namespace esim::inline backends::inline opengl
