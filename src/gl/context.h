// A headless OpenGL 4.5 core context, on an EGL device, EGL surfaceless, or OSMesa. The libraries
// are opened at run time (dlopen, RTLD_LOCAL). One context is current at a time, in the thread that
// created it. GL objects belong to the context that was current when they were created.
//
// State that is set once for every context: clip space with the origin at the upper left and depth
// 0..1 (so row 0 of every image is its top row, and reversed-Z keeps its precision), seamless cube
// maps, tightly packed pixel transfers, no dithering, no multisampling.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "gl/device.h"

namespace catoptric::gl {

/// How the time of a step is measured on this device.
enum class TimerKind {
  FinishClock,  ///< glFinish and the monotonic clock (llvmpipe's timer queries are wrong)
  TimerQuery,   ///< GL_TIMESTAMP queries
};

/// Limits of the context that the program's decisions depend on.
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
  int maxTextureUnits = 0;  ///< combined, over all shader stages
  int maxComputeInvocations = 0;
};

struct DeviceInfo {
  Platform platform = Platform::EglDevice;
  std::string device;           ///< in the syntax of --device: "egl:0", "surfaceless", "osmesa"
  std::string platformVersion;  ///< EGL vendor and version, or OSMesa's library
  std::string renderer;         ///< GL_RENDERER
  std::string vendor;           ///< GL_VENDOR
  std::string version;          ///< GL_VERSION
  std::string glslVersion;
  bool software = false;  ///< rendered by the CPU (llvmpipe, softpipe, swrast)
  TimerKind timer = TimerKind::FinishClock;
  int timerQueryBits =
      0;  ///< GL_QUERY_COUNTER_BITS of GL_TIMESTAMP; not a proof that the queries are accurate
  Limits limits;
};

class Context {
 public:
  /// Creates a context on the chosen device and makes it current. `auto` tries the EGL devices
  /// (GPUs first), surfaceless and OSMesa, and logs which one it took. Throws DeviceError, which
  /// lists what was tried, how each attempt ended, and what to do.
  explicit Context(const DeviceChoice& choice = {});
  ~Context();
  Context(Context&&) noexcept;
  Context& operator=(Context&&) noexcept;

  const DeviceInfo& info() const;
  bool has(const std::string& extension) const;

  /// Makes this context current and loads its functions. Needed after another one was current.
  void makeCurrent();

  /// Waits until all commands have finished. Throws Error (Internal) if GL reports an error, or if
  /// the driver has reported one through KHR_debug since the last call. `place` names the caller's
  /// step in the message.
  void finish(const char* place);

  /// As finish(), but does not wait.
  void check(const char* place);

  /// The current context of this process. Throws std::logic_error if there is none.
  static Context& current();
  static bool hasCurrent();

  /// A number that differs for each context of the process; 0 means no context. GL objects use it.
  static std::uint32_t currentSerial();

  struct State;

 private:
  std::unique_ptr<State> state_;
};

/// Calls check() of the current context.
void checkErrors(const char* place);

}  // namespace catoptric::gl
