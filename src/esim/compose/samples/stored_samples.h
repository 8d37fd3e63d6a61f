#pragma once

#include <memory>
#include <optional>

#include "esim/render/renderer.h"
#include "esim/sample_store/sample_store.h"
#include "esim/sampling/sampler.h"

// Private to compose.
namespace esim::inline compose {

/// A renderer that renders nothing, for samplers that have all samples.
std::unique_ptr<Renderer> make_no_renderer();

/// A sampler without segments, for cameras without event sensors.
std::unique_ptr<Sampler> make_no_sampler(TimeNs end);

/// A sampler whose segments come from a store. The workers must outlive it. If given a time `begin` (ns), it starts
/// there: each tile begins with its first segment that ends after it.
std::unique_ptr<Sampler> make_stored_sampler(SampleStoreReader store, const Workers& workers,
                                             std::optional<TimeNs> begin = {});

}  // namespace esim::inline compose
