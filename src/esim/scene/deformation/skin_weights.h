#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace esim::inline scene {

/// The joints that move each vertex of a mesh, and by which fraction.
struct SkinWeights {
  struct Influence {
    std::uint32_t joint = 0;
    float weight = 0;  ///< those of a vertex have the sum 1
  };

  std::vector<std::uint32_t> ends;  ///< per vertex: where its influences end; those of the next begin there
  std::vector<Influence> influences;

  std::size_t begin_of(std::size_t vertex) const { return vertex == 0 ? 0 : ends[vertex - 1]; }
};

}  // namespace esim::inline scene
