#pragma once

#include <memory>

#include "esim/render/deforming_surfaces.h"
#include "esim/scene/scene.h"

namespace esim::inline compose {

/// How the deforming objects of a scene move; null if all of its objects are rigid.
std::shared_ptr<const DeformingSurfaces> deforming_surfaces(const Scene& scene);

}  // namespace esim::inline compose
