#pragma once

#include <memory>

#include "esim/render/renderer.h"
#include "esim/sample_store/sample_store.h"
#include "esim/sampling/sampler.h"

// Private to compose.
namespace esim::inline compose {

/// A renderer that renders nothing, for samplers that have all samples.
std::unique_ptr<Renderer> make_no_renderer();

/// A sampler without segments, for cameras without event sensors.
std::unique_ptr<Sampler> make_no_sampler(TimeNs end);

/// A sampler whose segments come from a store. The workers must outlive it.
std::unique_ptr<Sampler> make_stored_sampler(SampleStoreReader store, const Workers& workers);

/// The same from a time (ns) on: each tile begins with its first segment that ends after `begin`.
std::unique_ptr<Sampler> make_stored_sampler(SampleStoreReader store, TimeNs begin, const Workers& workers);

}  // namespace esim::inline compose
