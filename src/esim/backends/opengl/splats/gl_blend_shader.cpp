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
layout(local_size_x = kBin * kBin) in;
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

// Blocks of 8 x 4 pixels, each of 32 invocations; for each, which splats of the batch may be visible in it
const uint kBlocksOfBin = kBatch / 32, kWords = kBatch / 32;
shared uint reached[kBlocksOfBin * kWords];

uvec2 corner_of(uint block) { return gl_WorkGroupID.xy * kBin + uvec2(block % 2 * 8, block / 2 * 4); }

float exponent_at(ScreenSplat splat, vec2 d) {
  return d.x * (splat.place.z * d.x + splat.place.w * d.y) + (splat.peak.x * d.y * d.y + splat.peak.y);
}

// Whether the splat may be visible in the block. The exponent is largest at the block's point nearest to the centre in
// one coordinate, and at the best place in the other.
bool may_reach(ScreenSplat splat, uint block) {
  vec2 low = vec2(corner_of(block)) - splat.place.xy, high = low + vec2(7, 3), nearest = clamp(vec2(0), low, high);
  float along_x = -0.5 * splat.place.w / splat.place.z * nearest.y;
  float along_y = -0.5 * splat.place.w / splat.peak.x * nearest.x;
  float largest = max(exponent_at(splat, vec2(clamp(along_x, low.x, high.x), nearest.y)),
                      exponent_at(splat, vec2(nearest.x, clamp(along_y, low.y, high.y))));
  return !(largest < kLog2Invisible - 0.001);  // with room for rounding
}

float linear_light(float encoded) {
  if (curve_steps == 0 || encoded <= 0) return max(encoded, 0.0);
  float at = encoded * float(curve_steps);
  if (at >= float(curve_steps))
    return display_gamma > 0 ? pow(encoded, display_gamma) : pow((encoded + 0.055) / 1.055, 2.4);
  uint i = uint(at);
  return curve[i] + (at - float(i)) * (curve[i + 1] - curve[i]);
}

void main() {
  uint me = gl_LocalInvocationIndex, block = me / 32;
  uvec2 pixel = corner_of(block) + uvec2(me % 8, me / 8 % 4);
  uvec2 range = ranges[gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x];
  bool inside = all(lessThan(pixel, uvec2(size)));
  vec3 colour = vec3(0);
  float transmittance = inside ? 1 : 0, nearness = 0, object = 0;
  for (uint start = range.x; start < range.y; start += kBatch) {
    if (me == 0) unfinished = 0;
    if (me < kBlocksOfBin * kWords) reached[me] = 0;
    barrier();
    if (transmittance > kFinished) unfinished = 1;
    barrier();
    if (unfinished == 0) break;
    uint many = min(kBatch, range.y - start);
    if (me < many) {
      uint from = 4 * items_in[start + me].y;
      ScreenSplat splat = ScreenSplat(on_screen[from], on_screen[from + 1], on_screen[from + 2], on_screen[from + 3]);
      for (uint i = 0; i < kBlocksOfBin; ++i) {
        if (may_reach(splat, i)) atomicOr(reached[i * kWords + me / 32], 1u << (me % 32));
      }
      batch[me] = splat;
    }
    barrier();
    for (uint word = 0; word < kWords; ++word) {
      uint left = reached[block * kWords + word];
      while (left != 0 && transmittance > kFinished) {
        uint i = word * 32 + findLSB(left);
        left &= left - 1;
        vec2 d = vec2(pixel) - batch[i].place.xy;
        float exponent = exponent_at(batch[i], d);
        if (!(exponent > kLog2Invisible)) continue;
        float raw = exp2(exponent);
        float fade = clamp((raw - kInvisible) * (1 / (kFadeFrom - kInvisible)), 0.0, 1.0);
        float weight = transmittance * min(raw * fade, kOpaque), after = transmittance - weight;
        colour += weight * batch[i].colour.rgb;
        if (transmittance >= 0.5 && after < 0.5) {
          vec4 depth = batch[i].depth;
          nearness = min(max(batch[i].peak.z + dot(depth.xy, d), depth.z), depth.w);
          object = batch[i].peak.w;
        }
        transmittance = after;
      }
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
