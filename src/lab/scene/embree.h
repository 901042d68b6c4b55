#pragma once

// Embree 3 (Debian 12) and Embree 4 (Debian 13) pass a query's context and flags differently. Include this header
// instead of Embree's own.
#if ANCHORSPLAT_EMBREE_MAJOR >= 4
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

namespace anchorsplat::embree {

#if ANCHORSPLAT_EMBREE_MAJOR >= 4

// Passed to filters of a query; to pass more data, begin a struct with it.
using QueryContext = RTCRayQueryContext;

inline void Init(QueryContext& context) { rtcInitRayQueryContext(&context); }

// Nearest hits of eight coherent rays, those with `valid` −1.
inline void IntersectCoherent(const int* valid, RTCScene scene, QueryContext& context, RTCRayHit8& rays) {
  RTCIntersectArguments arguments;
  rtcInitIntersectArguments(&arguments);
  arguments.flags = RTC_RAY_QUERY_FLAG_COHERENT;
  arguments.context = &context;
  rtcIntersect8(valid, scene, &rays, &arguments);
}

// Whether anything blocks `ray`.
inline bool Occluded(RTCScene scene, QueryContext& context, RTCRay& ray) {
  RTCOccludedArguments arguments;
  rtcInitOccludedArguments(&arguments);
  arguments.context = &context;
  rtcOccluded1(scene, &ray, &arguments);
  return ray.tfar < 0;
}

#else

using QueryContext = RTCIntersectContext;

inline void Init(QueryContext& context) { rtcInitIntersectContext(&context); }

inline void IntersectCoherent(const int* valid, RTCScene scene, QueryContext& context, RTCRayHit8& rays) {
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  rtcIntersect8(valid, scene, &context, &rays);
}

inline bool Occluded(RTCScene scene, QueryContext& context, RTCRay& ray) {
  rtcOccluded1(scene, &context, &ray);
  return ray.tfar < 0;
}

#endif

}  // namespace anchorsplat::embree
