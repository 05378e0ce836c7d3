// Private to src/trace/embree: rays into packets of Embree and hits out of them, by vector
// instructions.
#pragma once

#include <embree3/rtcore.h>
#include <xmmintrin.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "trace/embree/ray_lanes.h"
#include "trace/embree/trace_scene.h"

namespace catoptric::trace {

/// Largest coordinate of a ray that is given to Embree.
inline constexpr float kRayLargest = 1e18f;

template <int N>
struct Packet;
template <>
struct Packet<4> {
  using RayHit = RTCRayHit4;
  using Rays = RTCRay4;
  static constexpr auto intersect = rtcIntersect4;
  static constexpr auto occluded = rtcOccluded4;
};
template <>
struct Packet<8> {
  using RayHit = RTCRayHit8;
  using Rays = RTCRay8;
  static constexpr auto intersect = rtcIntersect8;
  static constexpr auto occluded = rtcOccluded8;
};
template <>
struct Packet<16> {
  using RayHit = RTCRayHit16;
  using Rays = RTCRay16;
  static constexpr auto intersect = rtcIntersect16;
  static constexpr auto occluded = rtcOccluded16;
};

static_assert(sizeof(Ray) == 32 && offsetof(Ray, direction) == 12 && offsetof(Ray, near) == 24 &&
              offsetof(Ray, far) == 28);
static_assert(sizeof(Hit) == 20 && offsetof(Hit, distance) == 16);

/// Where |x| < limit; false for NaN.
inline __m128 isBelow(__m128 x, __m128 limit) {
  return _mm_cmplt_ps(_mm_andnot_ps(_mm_set1_ps(-0.0f), x), limit);
}

/// Fills four lanes of a packet, from lane `at` on; lanes that must not be traced get a harmless
/// ray and valid = 0. The tests are those of isTraceable(). Returns the number of refused rays.
template <class Rays>
unsigned packFour(const Ray* rays, int at, Rays& packet, int* valid) {
  // Transpose: 32 bytes of a ray are origin and direction.x; direction.yz, near and far.
  const float* const from = &rays->origin.x;
  __m128 ox = _mm_loadu_ps(from);
  __m128 oy = _mm_loadu_ps(from + 8);
  __m128 oz = _mm_loadu_ps(from + 16);
  __m128 dx = _mm_loadu_ps(from + 24);
  _MM_TRANSPOSE4_PS(ox, oy, oz, dx);
  __m128 dy = _mm_loadu_ps(from + 4);
  __m128 dz = _mm_loadu_ps(from + 12);
  __m128 nearT = _mm_loadu_ps(from + 20);
  __m128 farT = _mm_loadu_ps(from + 28);
  _MM_TRANSPOSE4_PS(dy, dz, nearT, farT);

  // Which can be traced; of those a segment that holds no point hits nothing, and nothing is wrong.
  const __m128 limit = _mm_set1_ps(kRayLargest);
  const __m128 origin =
      _mm_and_ps(_mm_and_ps(isBelow(ox, limit), isBelow(oy, limit)), isBelow(oz, limit));
  const __m128 direction =
      _mm_and_ps(_mm_and_ps(isBelow(dx, limit), isBelow(dy, limit)), isBelow(dz, limit));
  const __m128 infinity = _mm_set1_ps(std::numeric_limits<float>::infinity());
  const __m128 range =
      _mm_and_ps(_mm_and_ps(_mm_cmpge_ps(nearT, _mm_setzero_ps()), _mm_cmplt_ps(nearT, infinity)),
                 _mm_cmpord_ps(farT, farT));
  const __m128 traceable = _mm_and_ps(_mm_and_ps(origin, direction), range);
  const __m128 use = _mm_and_ps(traceable, _mm_cmpge_ps(farT, nearT));

  const auto store = [&](float* lanes, __m128 value) {
    _mm_store_ps(lanes + at, _mm_and_ps(use, value));
  };
  store(packet.org_x, ox);
  store(packet.org_y, oy);
  store(packet.org_z, oz);
  store(packet.tnear, nearT);
  store(packet.dir_x, dx);
  store(packet.dir_y, dy);
  _mm_store_ps(packet.dir_z + at,
               _mm_or_ps(_mm_and_ps(use, dz), _mm_andnot_ps(use, _mm_set1_ps(-1.0f))));
  store(packet.tfar, farT);
  _mm_store_si128(reinterpret_cast<__m128i*>(valid + at), _mm_castps_si128(use));
  return static_cast<unsigned>(
      std::popcount(static_cast<unsigned>(_mm_movemask_ps(traceable)) ^ 0xFu));
}

/// Fills the first `count` of the packet's lanes and disables the rest; returns the refused rays.
template <int N, class Rays>
std::uint64_t pack(const Ray* rays, int count, Rays& packet, int* valid) {
  std::uint64_t refused = 0;
  int lane = 0;
  for (; lane + 4 <= count; lane += 4) refused += packFour(rays + lane, lane, packet, valid);
  for (; lane < N; lane += 4) {
    // The last packet: empty segments in place of missing rays.
    std::array<Ray, 4> some;
    for (Ray& ray : some) ray.far = -1.0f;
    for (int i = lane; i < count; ++i) some[i - lane] = rays[i];
    refused += packFour(some.data(), lane, packet, valid);
  }
  return refused;
}

/// The same of rays by components, from 0 to infinity, of which `left` remain from ray `first` on.
template <class Rays>
unsigned packFourLanes(const RayLanes& rays, std::size_t first, int left, int at, Rays& packet,
                       int* valid) {
  const __m128 ox = _mm_loadu_ps(rays.originX + first);
  const __m128 oy = _mm_loadu_ps(rays.originY + first);
  const __m128 oz = _mm_loadu_ps(rays.originZ + first);
  const __m128 dx = _mm_loadu_ps(rays.directionX + first);
  const __m128 dy = _mm_loadu_ps(rays.directionY + first);
  const __m128 dz = _mm_loadu_ps(rays.directionZ + first);
  const __m128 limit = _mm_set1_ps(kRayLargest);
  const __m128 origin =
      _mm_and_ps(_mm_and_ps(isBelow(ox, limit), isBelow(oy, limit)), isBelow(oz, limit));
  const __m128 direction =
      _mm_and_ps(_mm_and_ps(isBelow(dx, limit), isBelow(dy, limit)), isBelow(dz, limit));
  const __m128 exists =
      _mm_castsi128_ps(_mm_cmplt_epi32(_mm_setr_epi32(0, 1, 2, 3), _mm_set1_epi32(left)));
  const __m128 traceable = _mm_and_ps(origin, direction);
  const __m128 use = _mm_and_ps(traceable, exists);
  const auto store = [&](float* lanes, __m128 value) {
    _mm_store_ps(lanes + at, _mm_and_ps(use, value));
  };
  store(packet.org_x, ox);
  store(packet.org_y, oy);
  store(packet.org_z, oz);
  _mm_store_ps(packet.tnear + at, _mm_setzero_ps());
  store(packet.dir_x, dx);
  store(packet.dir_y, dy);
  _mm_store_ps(packet.dir_z + at,
               _mm_or_ps(_mm_and_ps(use, dz), _mm_andnot_ps(use, _mm_set1_ps(-1.0f))));
  store(packet.tfar, _mm_set1_ps(std::numeric_limits<float>::infinity()));
  _mm_store_si128(reinterpret_cast<__m128i*>(valid + at), _mm_castps_si128(use));
  return static_cast<unsigned>(
      std::popcount(static_cast<unsigned>(_mm_movemask_ps(_mm_andnot_ps(traceable, exists)))));
}

/// What all packets of a loop have in common.
template <int N, class Rays>
void setConstants(Rays& packet) {
  for (int i = 0; i < N; ++i) {
    packet.time[i] = 0.0f;
    packet.mask[i] = 0xFFFFFFFFu;
    packet.id[i] = static_cast<unsigned>(i);
    packet.flags[i] = 0;
  }
}

/// Four hits, or fewer at the end, from lane `at` on. Misses become Hit{}.
template <class RayHit>
void unpackFour(const RayHit& packet, int at, int count, Hit* hits) {
  // Embree leaves the lanes of misses alone, which were set to object -1 and zeros.
  const auto load = [&](const unsigned* lanes) {
    return _mm_castsi128_ps(_mm_load_si128(reinterpret_cast<const __m128i*>(lanes + at)));
  };
  __m128 object = load(packet.hit.geomID);
  const __m128 missed =
      _mm_castsi128_ps(_mm_cmpeq_epi32(_mm_castps_si128(object), _mm_set1_epi32(-1)));
  const __m128 distance =
      _mm_or_ps(_mm_andnot_ps(missed, _mm_load_ps(packet.ray.tfar + at)),
                _mm_and_ps(missed, _mm_set1_ps(std::numeric_limits<float>::infinity())));
  __m128 primitive = load(packet.hit.primID);
  __m128 u = _mm_load_ps(packet.hit.u + at);
  __m128 v = _mm_load_ps(packet.hit.v + at);
  _MM_TRANSPOSE4_PS(object, primitive, u, v);
  alignas(16) std::array<float, 4> distances;
  _mm_store_ps(distances.data(), distance);
  const __m128 rows[4] = {object, primitive, u, v};
  for (int i = 0; i < count; ++i) {
    _mm_storeu_ps(reinterpret_cast<float*>(&hits[i]), rows[i]);
    hits[i].distance = distances[i];
  }
}

inline RTCIntersectContext makeContext(bool coherent) {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags =
      coherent ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
  return context;
}

/// `fill(first, lanes, packet, valid)` packs rays and returns how many were refused.
template <int N, class Fill>
std::uint64_t intersectFilled(RTCScene scene, Hit* hits, std::size_t count, bool coherent,
                              const Fill& fill) {
  RTCIntersectContext context = makeContext(coherent);
  std::uint64_t refused = 0;
  typename Packet<N>::RayHit packet;
  setConstants<N>(packet.ray);
  alignas(64) std::array<int, N> valid;
  for (std::size_t first = 0; first < count; first += N) {
    const int lanes = static_cast<int>(std::min<std::size_t>(N, count - first));
    refused += fill(first, lanes, packet.ray, valid.data());
    for (int i = 0; i < N; ++i) {
      packet.hit.primID[i] = 0;
      packet.hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
      packet.hit.instID[0][i] = RTC_INVALID_GEOMETRY_ID;
      packet.hit.u[i] = 0.0f;
      packet.hit.v[i] = 0.0f;
    }
    Packet<N>::intersect(valid.data(), scene, &context, &packet);
    for (int lane = 0; lane < lanes; lane += 4) {
      unpackFour(packet, lane, std::min(4, lanes - lane),
                 hits + first + static_cast<std::size_t>(lane));
    }
  }
  return refused;
}

template <int N>
std::uint64_t intersectPackets(RTCScene scene, const Ray* rays, Hit* hits, std::size_t count,
                               bool coherent) {
  return intersectFilled<N>(scene, hits, count, coherent,
                            [&](std::size_t first, int lanes, auto& packet, int* valid) {
                              return pack<N>(rays + first, lanes, packet, valid);
                            });
}

template <int N>
std::uint64_t intersectPackets(RTCScene scene, const RayLanes& rays, Hit* hits, std::size_t count,
                               bool coherent) {
  return intersectFilled<N>(scene, hits, count, coherent,
                            [&](std::size_t first, int lanes, auto& packet, int* valid) {
                              std::uint64_t refused = 0;
                              for (int at = 0; at < N; at += 4)
                                refused += packFourLanes(rays, first + static_cast<std::size_t>(at),
                                                         lanes - at, at, packet, valid);
                              return refused;
                            });
}

template <int N>
std::uint64_t visiblePackets(RTCScene scene, const Ray* rays, std::uint8_t* free, std::size_t count,
                             bool coherent) {
  RTCIntersectContext context = makeContext(coherent);
  std::uint64_t refused = 0;
  typename Packet<N>::Rays packet;
  setConstants<N>(packet);
  alignas(64) std::array<int, N> valid;
  for (std::size_t first = 0; first < count; first += N) {
    const int lanes = static_cast<int>(std::min<std::size_t>(N, count - first));
    refused += pack<N>(rays + first, lanes, packet, valid.data());
    Packet<N>::occluded(valid.data(), scene, &context, &packet);
    // Embree marks blocked rays by tfar = -infinity.
    for (int i = 0; i < lanes; ++i) {
      const bool blocked = valid[i] != 0 && packet.tfar[i] < 0.0f;
      free[first + i] = blocked ? 0 : 1;
    }
  }
  return refused;
}

}  // namespace catoptric::trace
