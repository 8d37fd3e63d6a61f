#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "esim/sim/summary.h"
#include "esim/sim/world.h"

namespace esim::inline sim {

/// The variable state of a world between two samples, and the results so far, as bytes for the same build of esim.
/// Does not contain renderings in progress. Changes nothing.
std::vector<std::byte> save_state(World& world, const Summary& summary);

/// Restores them into an equal world. Throws UserError if the bytes do not suit it; the world can then not be used.
void restore_state(std::span<const std::byte> state, World& world, Summary& summary);

}  // namespace esim::inline sim
