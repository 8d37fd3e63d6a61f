#pragma once

// Private to compose.
namespace esim::inline compose {

/// The file of a camera's samples, in its folder.
inline constexpr const char* kSamplesFile = "samples.esim";

}  // namespace esim::inline compose
