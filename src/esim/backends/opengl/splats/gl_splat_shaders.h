#pragma once

#include <epoxy/gl.h>

#include <string>

// Private to backends/opengl: includes epoxy/gl.h.
/// The compute shaders of splats, as parts of sources for make_compute_program().
namespace esim::inline backends::inline opengl {

/// Bindings of buffers. A device has at least 8 of them, so that some have several uses.
enum GlSplatBinding : GLuint {
  kItemsIn = 0,    ///< uvec2 (key, splat), before a step
  kItemsOut = 1,   ///< the same, after it
  kOnScreen = 2,   ///< four vec4 per splat, as struct ScreenSplat of the shaders
  kBoxes = 3,      ///< uvec2 per splat: the bins from left to right and from top to bottom, 16 bits each
  kOrders = 4,     ///< uint per splat: the bits of its distance; 0: invisible
  kValues = 5,     ///< uints whose prefix sums are computed
  kSums = 6,       ///< of blocks of these
  kLengths = 7,    ///< GlSplatLists: the lengths of lists, and numbers of workgroups
  kSplats = 0,     ///< of an object: four vec4 each
  kHarmonics = 1,  ///< of an object: half floats
  kRanges = 5,     ///< uvec2 per bin: its first item, and the one after its last
  kImage = 6,      ///< floats: E of all pixels, 1 / Z, and objects as uints
  kCurve = 4,      ///< the table of DisplayCurve
};

/// Invocations of a workgroup, and values or items that one processes where it says "block".
inline constexpr GLuint kGlGroup = 256, kGlBlock = 2048;

/// The largest number of bits by which a pass sorts.
inline constexpr int kGlMaxBits = 9;

/// Side of a bin, px.
inline constexpr int kGlBin = 16;

/// Precedes all others: the numbers above, and those of scene/splats/splat_rules.h.
std::string gl_splat_rules();

/// Projects the splats of an object. `LENS` must be defined: 0 for a linear projection, otherwise 1 + the index of the
/// alternative of Distortion.
extern const char* const kProjectShader;

/// Precedes the three shaders of prefix sums.
extern const char* const kPrefixShader;
extern const char* const kPrefixOfBlocksShader;  ///< sums of blocks
extern const char* const kPrefixOfSumsShader;    ///< prefix sums of these, in one workgroup, and the length of a list
extern const char* const kPrefixInBlocksShader;  ///< prefix sums of all values

extern const char* const kVisibleShader;  ///< lists the visible splats
extern const char* const kCountShader;    ///< counts the bins of each listed splat
extern const char* const kBinsShader;     ///< lists the splats of all bins
extern const char* const kRangesShader;   ///< finds the bins in the sorted list

/// A stable pass of radix sort: digits per block, then, after prefix sums, the new order.
extern const char* const kDigitsShader;
extern const char* const kReorderShader;

extern const char* const kBlendShader;  ///< one workgroup per bin, one invocation per pixel

}  // namespace esim::inline backends::inline opengl
