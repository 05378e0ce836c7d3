// The options of billboards and depth_impostors. [Popescu2006] is "Reflected-Scene Impostors for
// Realistic Reflections at Interactive Rates".
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "config/options.h"

namespace catoptric::methods::impostors {

enum class Kind : std::uint8_t { Billboard, DepthMap };
/// How rays are intersected with a depth map [Popescu2006, Sec. 4].
enum class Intersection : std::uint8_t { Walk, Srdm, SrdmTwoRows };

inline constexpr auto kIntersections =
    config::names<Intersection>({{"walk", Intersection::Walk},
                                 {"srdm", Intersection::Srdm},
                                 {"srdm_two_rows", Intersection::SrdmTwoRows}});

/// Which objects get depth maps; the others get billboards.
enum class DepthMaps : std::uint8_t { Auto, All, Needed };

inline constexpr auto kDepthMaps = config::names<DepthMaps>(
    {{"auto", DepthMaps::Auto}, {"all", DepthMaps::All}, {"needed", DepthMaps::Needed}});

/// What renders reflectors whose images exceed the memory or take longer than tracing.
enum class Fallback : std::uint8_t { Traced, None };

inline constexpr auto kFallbacks =
    config::names<Fallback>({{"traced", Fallback::Traced}, {"none", Fallback::None}});

/// Whether the GPU or the CPU intersects the rays of mirrors.
enum class Unit : std::uint8_t { Auto, Device, Processor };

inline constexpr auto kUnits = config::names<Unit>(
    {{"auto", Unit::Auto}, {"device", Unit::Device}, {"processor", Unit::Processor}});

struct Options {
  std::vector<std::string> objects = {"auto"};
  float least = 0.001f;   ///< error that needs an impostor, sr x rad; ours, measured in README.md
  int most = 64;          ///< objects with an impostor; not from the paper
  int textureSize = 256;  ///< texels; the paper's
  int planeSize = 512;    ///< texels; not from the paper; measured in docs/papers/impostors.md
  int faceSize = 512;     ///< texels, as in environment_map
  int bounces = 1;
  bool secondDiffuse = false;
  float transitionHeight = 0.0f;  ///< metres, the paper's H
  bool shareEnvironment = false;
  float attenuation = 0.0f;  ///< metres; 0: none
  Unit intersectOn = Unit::Auto;
  std::uint64_t memoryBytes = 1024ull << 20;
  Fallback fallback = Fallback::Traced;
  // Options of depth_impostors only
  Intersection intersection = Intersection::Srdm;
  int domains = 60;  ///< the paper's n
  int points = 8;    ///< the paper's m
  int refine = 4;    ///< texels; not from the paper; measured in docs/papers/impostors.md
  int maps = 0;      ///< depth maps of an object, for each reflector; 0: as many as it needs
  int layers = 1;    ///< depth layers, for each camera; not from the paper
  int selfMaps = 0;  ///< maps of a reflector for its own rays; not from the paper
  DepthMaps depthMaps = DepthMaps::Auto;
};

const config::OptionTable<Options>& billboardOptions();
const config::OptionTable<Options>& depthOptions();

}  // namespace catoptric::methods::impostors
