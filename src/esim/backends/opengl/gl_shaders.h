#pragma once

#include <epoxy/gl.h>

// Private to backends/opengl: includes epoxy/gl.h.
/// The shaders, as parts of sources for make_program().
namespace esim::inline backends::inline opengl {

// Vertex attributes, and bindings of buffers and textures.
inline constexpr GLuint kPosition = 0, kNormal = 1, kTextureUv = 2;
inline constexpr GLuint kLightsBinding = 0, kTwistsBinding = 1, kShadowViewsBinding = 2, kAreasBinding = 3,
                        kSurroundingsBinding = 4;
inline constexpr GLuint kBaseTexture = 0, kEmissionTexture = 1, kStillShadows = 2, kMovingShadows = 3;
inline constexpr GLuint kGlossTextures = 4, kSkyTexture = 9;  // five, in the order of GlScene::Part; one
inline constexpr GLuint kSeen = 0, kWhich = 1, kCentres = 2, kFootprints = 3, kBearings = 4, kJacobians = 5,
                        kPoints = 6;

/// Precedes the shader of the last pass, which writes E, Z and V. The other passes write E, 1 / Z and its slopes to the
/// right and downwards.
extern const char* const kLastPassShader;

/// Precedes kResolveFragmentShader if pixels have more than one sample.
extern const char* const kSeveralSamples;

/// Precedes all shaders of surfaces, resolving and distorting if objects deform: then these also write the point of a
/// surface, as the number of its triangle in the object and two barycentric coordinates.
extern const char* const kDeforms;

/// Precedes the fragment shader of surfaces if lights cast shadows.
extern const char* const kShadowShader;

/// Precedes the shaders of surfaces and of the sky.
extern const char* const kMeanShader;

/// If surfaces shine: the first precedes the fragment shader of surfaces, the second follows it.
extern const char* const kGlossyDefinition;
extern const char* const kGlossyShader;

/// The environment as the background: a pass over the whole image.
extern const char* const kSkyFragmentShader;

extern const char* const kSurfaceVertexShader;
extern const char* const kSurfaceFragmentShader;
extern const char* const kShadowMapVertexShader;
extern const char* const kShadowMapFragmentShader;
extern const char* const kWholeImageVertexShader;
extern const char* const kResolveFragmentShader;
extern const char* const kDistortFragmentShader;

}  // namespace esim::inline backends::inline opengl
