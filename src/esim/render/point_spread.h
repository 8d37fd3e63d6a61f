#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "esim/core/parallel.h"
#include "esim/geometry/camera.h"
#include "esim/render/renderer.h"

namespace esim::inline render {

/// The half of a Gaussian kernel for images, with the standard deviation `sigma` (px, above 0): the weights at
/// distances of 0, 1, ... px. Both halves add up to 1, and their variance is sigma².
std::vector<float> gaussian_half_kernel(double sigma);

/// A renderer with a lens that blurs: E is convolved with a Gaussian of standard deviation `sigma` (px). Z, V and
/// objects are those of the centre of each pixel. If it `sees_more`, light from outside the image counts: `make` is
/// asked for a renderer of a larger image. Otherwise, or if that draws on the sensor, the pixels at the border are
/// repeated. Null if make() returns null. Throws UserError if the lens cannot be inverted outside the image.
std::unique_ptr<Renderer> with_point_spread(const std::function<std::unique_ptr<Renderer>(const Camera& camera)>& make,
                                            const Camera& camera, double sigma, bool sees_more, const Workers& workers);

}  // namespace esim::inline render
