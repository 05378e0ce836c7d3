// Private to src/trace/embree: packs rays into Embree's packets and unpacks hits, four at a time.
#pragma once

#include <embree3/rtcore.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "core/lanes.h"
#include "trace/embree/ray_lanes.h"
#include "trace/embree/trace_scene.h"

namespace catoptric::trace {

/// Rays with larger coordinates are not passed to Embree.
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

/// Four rays, stored by component.
struct FourRays {
  Floats4 originX, originY, originZ, directionX, directionY, directionZ, near, far;
};

inline FourRays fourOf(const Ray* rays) {
  // The 32 bytes of a ray hold origin and direction.x, then direction.yz, near and far
  const auto part = [&](int i) { return load<Floats4>(&rays->origin.x + 4 * i); };
  FourRays r{part(0), part(2), part(4), part(6), part(1), part(3), part(5), part(7)};
  transpose(r.originX, r.originY, r.originZ, r.directionX);
  transpose(r.directionY, r.directionZ, r.near, r.far);
  return r;
}
/// The rays extend from 0 to infinity.
inline FourRays fourOf(const RayLanes& rays, std::size_t first) {
  const auto part = [&](const float* lane) { return load<Floats4>(lane + first); };
  return {part(rays.originX),    part(rays.originY),
          part(rays.originZ),    part(rays.directionX),
          part(rays.directionY), part(rays.directionZ),
          floats4(0.0f),         floats4(std::numeric_limits<float>::infinity())};
}

/// Whether |x| is small enough for Embree; false for NaN.
inline Mask4 isBounded(const Floats4& x) {
  return (x < kRayLargest) & (x > -kRayLargest);
}

/// Fills four lanes of a packet, starting at lane `at`, with the rays that exist. Lanes that must
/// not be traced get a harmless ray and valid = 0. The tests are the same as in isTraceable().
/// Returns the number of refused rays.
template <class Rays>
unsigned packFour(const FourRays& r, const Mask4& exists, int at, Rays& packet, int* valid) {
  // A traceable ray with an empty segment (far < near) hits nothing. This is no error.
  const Mask4 traceable = isBounded(r.originX) & isBounded(r.originY) & isBounded(r.originZ) &
                          isBounded(r.directionX) & isBounded(r.directionY) &
                          isBounded(r.directionZ) & (r.near >= 0.0f) &
                          (r.near < std::numeric_limits<float>::infinity()) & (r.far == r.far);
  const Mask4 use = traceable & exists & (r.far >= r.near);
  const auto put = [&](const Floats4& value, float* lanes) {
    store(use & std::bit_cast<Mask4>(value), lanes + at);
  };
  put(r.originX, packet.org_x);
  put(r.originY, packet.org_y);
  put(r.originZ, packet.org_z);
  put(r.near, packet.tnear);
  put(r.directionX, packet.dir_x);
  put(r.directionY, packet.dir_y);
  store(use ? r.directionZ : floats4(-1.0f), packet.dir_z + at);
  put(r.far, packet.tfar);
  store(use, valid + at);
  return static_cast<unsigned>(std::popcount(bitsOf(exists & ~traceable)));
}

/// Fills the first `count` lanes of the packet and disables the others. Returns the number of
/// refused rays.
template <int N, class Rays>
std::uint64_t pack(const Ray* rays, int count, Rays& packet, int* valid) {
  constexpr Mask4 kAll{-1, -1, -1, -1};
  std::uint64_t refused = 0;
  int lane = 0;
  for (; lane + 4 <= count; lane += 4)
    refused += packFour(fourOf(rays + lane), kAll, lane, packet, valid);
  for (; lane < N; lane += 4) {
    // The last packet: empty segments replace the missing rays
    std::array<Ray, 4> some;
    for (Ray& ray : some) ray.far = -1.0f;
    for (int i = lane; i < count; ++i) some[i - lane] = rays[i];
    refused += packFour(fourOf(some.data()), kAll, lane, packet, valid);
  }
  return refused;
}

/// Sets the members that are the same for all packets of a loop.
template <int N, class Rays>
void setConstants(Rays& packet) {
  for (int i = 0; i < N; ++i) {
    packet.time[i] = 0.0f;
    packet.mask[i] = 0xFFFFFFFFu;
    packet.id[i] = static_cast<unsigned>(i);
    packet.flags[i] = 0;
  }
}

/// Unpacks up to four hits, starting at lane `at`. Misses become Hit{}.
template <class RayHit>
void unpackFour(const RayHit& packet, int at, int count, Hit* hits) {
  // Embree leaves the lanes of misses unchanged; they were set to object -1 and zeros
  const Mask4 missed = load<Mask4>(packet.hit.geomID + at) == -1;
  const Floats4 distance = missed ? floats4(std::numeric_limits<float>::infinity())
                                  : load<Floats4>(packet.ray.tfar + at);
  std::array<Floats4, 4> rows{load<Floats4>(packet.hit.geomID + at),
                              load<Floats4>(packet.hit.primID + at),
                              load<Floats4>(packet.hit.u + at), load<Floats4>(packet.hit.v + at)};
  transpose(rows[0], rows[1], rows[2], rows[3]);
  for (int i = 0; i < count; ++i) {
    store(rows[i], &hits[i]);
    hits[i].distance = distance[i];
  }
}

inline RTCIntersectContext makeContext(bool coherent) {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags =
      coherent ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
  return context;
}

/// `fill(first, lanes, packet, valid)` packs rays and returns the number of refused ones.
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
  return intersectFilled<N>(
      scene, hits, count, coherent, [&](std::size_t first, int lanes, auto& packet, int* valid) {
        std::uint64_t refused = 0;
        for (int at = 0; at < N; at += 4)
          refused += packFour(fourOf(rays, first + static_cast<std::size_t>(at)),
                              Mask4{0, 1, 2, 3} < lanes - at, at, packet, valid);
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
    // Embree marks blocked rays by tfar = -infinity
    for (int i = 0; i < lanes; ++i) {
      const bool blocked = valid[i] != 0 && packet.tfar[i] < 0.0f;
      free[first + i] = blocked ? 0 : 1;
    }
  }
  return refused;
}

}  // namespace catoptric::trace
