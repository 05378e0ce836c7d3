// A headless OpenGL 4.5 core context: on an EGL device, EGL surfaceless, or OSMesa. Libraries are
// opened at run time (dlopen, RTLD_LOCAL). One context is current at a time, in the thread that
// made it; GL objects belong to the context that was current when they were made.
//
// State set once, for every context: clip space with the origin at the upper left and depth
// 0..1 (so row 0 of every image is its top, and reversed-Z keeps its precision), seamless cube
// maps, byte-tight pixel transfers, no dithering, no multisampling.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "gl/device.h"

namespace catoptric::gl {

/// How a step's time is to be taken on this device.
enum class TimerKind {
  FinishClock,  ///< glFinish and the monotonic clock (llvmpipe's timer queries lie)
  TimerQuery,   ///< GL_TIMESTAMP queries
};

/// Limits that the program's choices depend on.
struct Limits {
  int maxTextureSize = 0;
  int maxArrayLayers = 0;
  int maxCubeMapSize = 0;
  std::int64_t maxTextureBufferTexels = 0;
  std::int64_t maxStorageBufferBytes = 0;
  int maxStorageBufferBindings = 0;
  int maxUniformBlockBytes = 0;
  int maxColorAttachments = 0;
  int maxViewports = 0;
  int maxViewportSize = 0;
  int maxTextureUnits = 0;  ///< combined, of all stages
  int maxComputeInvocations = 0;
};

struct DeviceInfo {
  Platform platform = Platform::EglDevice;
  std::string device;           ///< as --device names it: "egl:0", "surfaceless", "osmesa"
  std::string platformVersion;  ///< EGL vendor and version, or OSMesa's library
  std::string renderer;         ///< GL_RENDERER
  std::string vendor;           ///< GL_VENDOR
  std::string version;          ///< GL_VERSION
  std::string glslVersion;
  bool software = false;  ///< rendered by the CPU (llvmpipe, softpipe, swrast)
  TimerKind timer = TimerKind::FinishClock;
  int timerQueryBits = 0;  ///< GL_QUERY_COUNTER_BITS of GL_TIMESTAMP, whatever it is worth
  Limits limits;
};

class Context {
 public:
  /// Makes a context on the chosen device and makes it current. Throws DeviceError that lists what
  /// was tried, how each attempt ended, and what to do. `auto` tries the EGL devices (GPUs first),
  /// surfaceless, OSMesa, and logs which one it took.
  explicit Context(const DeviceChoice& choice = {});
  ~Context();
  Context(Context&&) noexcept;
  Context& operator=(Context&&) noexcept;

  const DeviceInfo& info() const;
  bool has(const std::string& extension) const;

  /// Makes this context current and loads its functions. Only needed after another context was
  /// made or made current.
  void makeCurrent();

  /// Waits until all commands are done; throws Error (Internal) when GL reports an error or the
  /// driver reported one through KHR_debug since the last call. `place` names the caller's step.
  void finish(const char* place);

  /// As finish(), without waiting.
  void check(const char* place);

  /// The context current in this process; throws std::logic_error when there is none.
  static Context& current();
  static bool hasCurrent();

  /// Different for each context of the process; 0 is none. Used by GL objects.
  static std::uint32_t currentSerial();

  struct State;

 private:
  std::unique_ptr<State> state_;
};

/// Shorthands for the current context.
void checkErrors(const char* place);

}  // namespace catoptric::gl
