#pragma once

// Embree 3 and 4 pass the arguments of a query in different ways. CMakeLists.txt defines ESIM_EMBREE_MAJOR as the
// version that was found.
#if ESIM_EMBREE_MAJOR >= 4
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

#include <type_traits>

// Private to backends/raycast: includes Embree.
namespace esim::inline backends::inline raycast::embree {

/// K rays that are traced together: 4, 8 or 16.
template <int K>
using Rays = std::conditional_t<K == 16, RTCRay16, std::conditional_t<K == 8, RTCRay8, RTCRay4>>;

/// K rays and their hits.
template <int K>
using RayHits = std::conditional_t<K == 16, RTCRayHit16, std::conditional_t<K == 8, RTCRayHit8, RTCRayHit4>>;

/// Finds the nearest triangle that each ray hits. `valid` has K numbers: -1 if the lane has a ray, otherwise 0.
/// Embree writes `instance` into instID[0] of the hits. The rays should be coherent, like those of neighbouring pixels.
template <int K>
void intersect(const int* valid, RTCScene scene, unsigned instance, RayHits<K>& rays) {
#if ESIM_EMBREE_MAJOR >= 4
  RTCRayQueryContext context;
  rtcInitRayQueryContext(&context);
  RTCIntersectArguments arguments;
  rtcInitIntersectArguments(&arguments);
  arguments.flags = RTC_RAY_QUERY_FLAG_COHERENT;
  arguments.context = &context;
  const auto query = [&](auto* function) { function(valid, scene, &rays, &arguments); };
#else
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  const auto query = [&](auto* function) { function(valid, scene, &context, &rays); };
#endif
  context.instID[0] = instance;
  if constexpr (K == 16) query(rtcIntersect16);
  if constexpr (K == 8) query(rtcIntersect8);
  if constexpr (K == 4) query(rtcIntersect4);
}

/// Sets tfar to minus infinity if a ray hits any triangle. `valid` as above.
template <int K>
void occlude(const int* valid, RTCScene scene, Rays<K>& rays) {
  // Not as coherent rays: with these, Embree 3.13 sometimes does not terminate.
#if ESIM_EMBREE_MAJOR >= 4
  RTCOccludedArguments arguments;
  rtcInitOccludedArguments(&arguments);
  const auto query = [&](auto* function) { function(valid, scene, &rays, &arguments); };
#else
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  const auto query = [&](auto* function) { function(valid, scene, &context, &rays); };
#endif
  if constexpr (K == 16) query(rtcOccluded16);
  if constexpr (K == 8) query(rtcOccluded8);
  if constexpr (K == 4) query(rtcOccluded4);
}

}  // namespace esim::inline backends::inline raycast::embree
