#include "gl/context.h"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <mutex>
#include <set>
#include <stdexcept>
#include <utility>

#include "core/error.h"
#include "core/log.h"
#include "gl/api.h"
#include "gl/context_state.h"
#include "gl/platform.h"
#include "gl/probe.h"
#include "gl/workarounds.h"

namespace catoptric::gl {

struct Context::State {
  std::unique_ptr<PlatformContext> platform;
  DeviceInfo info;
  std::set<std::string> extensions;
  std::uint32_t serial = 0;
  GLuint emptyVertexArray = 0;
  Context* owner = nullptr;

  std::mutex messagesMutex;  // drivers may report from threads of their own
  std::vector<std::string> messages;
};

namespace {

Context::State* currentState = nullptr;
std::uint32_t lastSerial = 0;
std::set<std::uint32_t> liveSerials;

constexpr std::size_t kMaxMessages = 16;  // kept per check; more say nothing new

std::string glText(GLenum name) {
  const GLubyte* text = glGetString(name);
  return text != nullptr ? reinterpret_cast<const char*>(text) : "";
}

int integer(GLenum name) {
  GLint value = 0;
  glGetIntegerv(name, &value);
  return value;
}

std::int64_t integer64(GLenum name) {
  GLint64 value = 0;
  glGetInteger64v(name, &value);
  return value;
}

Limits readLimits() {
  Limits limits;
  limits.maxTextureSize = integer(GL_MAX_TEXTURE_SIZE);
  limits.maxArrayLayers = integer(GL_MAX_ARRAY_TEXTURE_LAYERS);
  limits.maxCubeMapSize = integer(GL_MAX_CUBE_MAP_TEXTURE_SIZE);
  limits.maxTextureBufferTexels = integer64(GL_MAX_TEXTURE_BUFFER_SIZE);
  limits.maxStorageBufferBytes = integer64(GL_MAX_SHADER_STORAGE_BLOCK_SIZE);
  limits.maxStorageBufferBindings = integer(GL_MAX_SHADER_STORAGE_BUFFER_BINDINGS);
  limits.maxUniformBlockBytes = integer(GL_MAX_UNIFORM_BLOCK_SIZE);
  limits.maxColorAttachments = integer(GL_MAX_COLOR_ATTACHMENTS);
  limits.maxViewports = integer(GL_MAX_VIEWPORTS);
  std::array<GLint, 2> viewport{};
  glGetIntegerv(GL_MAX_VIEWPORT_DIMS, viewport.data());
  limits.maxViewportSize = std::min(viewport[0], viewport[1]);
  limits.maxTextureUnits = integer(GL_MAX_COMBINED_TEXTURE_IMAGE_UNITS);
  limits.maxComputeInvocations = integer(GL_MAX_COMPUTE_WORK_GROUP_INVOCATIONS);
  return limits;
}

bool isSoftwareRenderer(const std::string& renderer) {
  for (const char* name : {"llvmpipe", "softpipe", "swrast", "Software", "software"}) {
    if (renderer.find(name) != std::string::npos) return true;
  }
  return false;
}

void GLAD_API_PTR onDebugMessage(GLenum, GLenum type, GLuint, GLenum severity, GLsizei length,
                                 const GLchar* message, const void* user) {
  if (severity != GL_DEBUG_SEVERITY_HIGH && type != GL_DEBUG_TYPE_ERROR) return;
  auto* state = static_cast<Context::State*>(const_cast<void*>(user));
  const std::scoped_lock lock(state->messagesMutex);
  if (state->messages.size() >= kMaxMessages) return;
  std::string text =
      length >= 0 ? std::string(message, static_cast<std::size_t>(length)) : std::string(message);
  while (!text.empty() && text.back() == '\n') text.pop_back();
  state->messages.push_back(std::move(text));
}

std::string errorName(GLenum error) {
  switch (error) {
    case GL_INVALID_ENUM:
      return "GL_INVALID_ENUM";
    case GL_INVALID_VALUE:
      return "GL_INVALID_VALUE";
    case GL_INVALID_OPERATION:
      return "GL_INVALID_OPERATION";
    case GL_INVALID_FRAMEBUFFER_OPERATION:
      return "GL_INVALID_FRAMEBUFFER_OPERATION";
    case GL_OUT_OF_MEMORY:
      return "GL_OUT_OF_MEMORY";
    default:
      return "GL error " + std::to_string(error);
  }
}

// Loads all functions of the context that is current in the driver.
void loadFunctions(const PlatformContext& platform) {
  const int version = gladLoadGLUserPtr(
      [](void* user, const char* name) {
        return reinterpret_cast<GLADapiproc>(
            static_cast<const PlatformContext*>(user)->function(name));
      },
      const_cast<PlatformContext*>(&platform));
  // A second GL library in the process makes calls return nothing, silently.
  if (version == 0 || glGetString == nullptr || glGetString(GL_VERSION) == nullptr) {
    throw PlatformFailure{"the context is current, but glGetString(GL_VERSION) gives nothing",
                          "another OpenGL library is linked or preloaded: remove it (LD_PRELOAD)"};
  }
}

void setFixedState(Context::State& state) {
  glClipControl(GL_UPPER_LEFT, GL_ZERO_TO_ONE);
  glEnable(GL_TEXTURE_CUBE_MAP_SEAMLESS);
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  glDisable(GL_DITHER);
  glDisable(GL_MULTISAMPLE);
  glDebugMessageCallback(onDebugMessage, &state);
  glDebugMessageControl(GL_DONT_CARE, GL_DONT_CARE, GL_DEBUG_SEVERITY_NOTIFICATION, 0, nullptr,
                        GL_FALSE);
  glEnable(GL_DEBUG_OUTPUT);
}

void release(Context::State* state) noexcept {
  if (state != nullptr) state->platform->release();
}

// Makes `next` current in its driver.
void switchTo(Context::State& next) {
  if (currentState == &next) return;
  Context::State* old = std::exchange(currentState, nullptr);
  if (worksAround(Workaround::MesaReleaseBeforeSwitch)) release(old);
  next.platform->makeCurrent();
  try {
    loadFunctions(*next.platform);
  } catch (...) {
    next.platform->release();
    throw;
  }
  currentState = &next;
}

std::string nameOf(Platform platform, int index) {
  return DeviceChoice{false, platform, index}.text();
}

// Fills the context's description and checks what the program needs. Throws PlatformFailure.
void inspect(Context::State& state, Platform platform, int index) {
  DeviceInfo& info = state.info;
  info.platform = platform;
  info.device = nameOf(platform, index);
  info.platformVersion = state.platform->version();
  info.renderer = glText(GL_RENDERER);
  info.vendor = glText(GL_VENDOR);
  info.version = glText(GL_VERSION);
  info.glslVersion = glText(GL_SHADING_LANGUAGE_VERSION);
  info.software = isSoftwareRenderer(info.renderer);
  const int count = integer(GL_NUM_EXTENSIONS);
  for (int i = 0; i < count; ++i) {
    const GLubyte* name = glGetStringi(GL_EXTENSIONS, static_cast<GLuint>(i));
    if (name != nullptr) state.extensions.insert(reinterpret_cast<const char*>(name));
  }

  // Require OpenGL 4.5 core with clip control and compiled shaders.
  const int major = integer(GL_MAJOR_VERSION);
  const int minor = integer(GL_MINOR_VERSION);
  const bool core = (integer(GL_CONTEXT_PROFILE_MASK) & GL_CONTEXT_CORE_PROFILE_BIT) != 0;
  const bool clipControl = glClipControl != nullptr;
  if (major * 10 + minor < 45 || !core || !clipControl) {
    throw PlatformFailure{"OpenGL 4.5 core with ARB_clip_control is needed; this is \"" +
                              info.version + "\" on " + info.renderer +
                              (core ? "" : ", not a core profile") +
                              (clipControl ? "" : ", without ARB_clip_control"),
                          "install a newer driver (Mesa 20 or newer), or unset "
                          "MESA_GL_VERSION_OVERRIDE and GALLIUM_DRIVER"};
  }
  info.limits = readLimits();
  GLint bits = 0;
  glGetQueryiv(GL_TIMESTAMP, GL_QUERY_COUNTER_BITS, &bits);
  info.timerQueryBits = bits;
  const bool lies = info.software && worksAround(Workaround::SoftwareFinishClock);
  info.timer = (lies || bits == 0) ? TimerKind::FinishClock : TimerKind::TimerQuery;
}

std::unique_ptr<Context::State> open(Platform platform, int index) {
  auto state = std::make_unique<Context::State>();
  Context::State* previous = currentState;
  state->platform = makePlatformContext(platform, index);
  try {
    switchTo(*state);
    inspect(*state, platform, index);
  } catch (...) {
    if (currentState == state.get()) {
      release(std::exchange(currentState, nullptr));
    }
    if (previous != nullptr && currentState == nullptr) switchTo(*previous);
    throw;
  }
  setFixedState(*state);
  state->serial = ++lastSerial;
  liveSerials.insert(state->serial);
  return state;
}

/// As open(), after a child process has survived it.
std::unique_ptr<Context::State> openSafely(Platform platform, int index) {
  // The child ends at once, without closing anything in the driver.
  requireSurvival(nameOf(platform, index), [&] { (void)open(platform, index).release(); });
  return open(platform, index);
}

struct Candidate {
  Platform platform;
  int index;
};

std::string attemptLine(const std::string& device, const PlatformFailure& failure) {
  return "\n  " + device + ": " + failure.message + "; " + failure.whatToDo;
}

// The order of `auto`: EGL devices (hardware before software), surfaceless, OSMesa.
std::vector<Candidate> automaticOrder(std::string& attempts) {
  std::vector<Candidate> order;
  try {
    requireSurvival("EGL's devices", [] { listEglDevices(); });
    std::vector<EglDeviceEntry> devices = listEglDevices();
    std::stable_partition(devices.begin(), devices.end(),
                          [](const EglDeviceEntry& d) { return !d.software; });
    for (const EglDeviceEntry& device : devices) {
      order.push_back({Platform::EglDevice, device.index});
    }
    if (devices.empty()) attempts += "\n  egl:N: EGL lists no devices; install a GPU's driver";
  } catch (const PlatformFailure& failure) {
    attempts += attemptLine("egl:N", failure);
  }
  order.push_back({Platform::EglSurfaceless, 0});
  order.push_back({Platform::OsMesa, 0});
  return order;
}

}  // namespace

std::unique_ptr<PlatformContext> makePlatformContext(Platform platform, int index) {
  if (std::getenv("LP_NATIVE_VECTOR_WIDTH") != nullptr &&
      worksAround(Workaround::MesaWidthWithoutCache))
    ::setenv("MESA_SHADER_CACHE_DISABLE", "true", 1);  // Mesa reads it when it makes a context
  return platform == Platform::OsMesa ? makeOsMesaContext() : makeEglContext(platform, index);
}

Context::Context(const DeviceChoice& choice) {
  if (!choice.automatic) {
    try {
      state_ = openSafely(choice.platform, choice.index);
    } catch (const PlatformFailure& failure) {
      throw DeviceError("device " + choice.text() + " cannot be used: " + failure.message +
                        ".\nWhat to do: " + failure.whatToDo +
                        ".\n`catoptric doctor` tries every device.");
    }
  } else {
    std::string attempts;
    for (const Candidate& candidate : automaticOrder(attempts)) {
      try {
        state_ = openSafely(candidate.platform, candidate.index);
        break;
      } catch (const PlatformFailure& failure) {
        attempts += attemptLine(nameOf(candidate.platform, candidate.index), failure);
      }
    }
    if (!state_) {
      throw DeviceError("no device has OpenGL 4.5 core. Tried:" + attempts);
    }
    log::info("device " + state_->info.device + " (auto): " + state_->info.renderer + ", OpenGL " +
              state_->info.version);
    if (!attempts.empty()) log::debug("devices tried before:" + attempts);
  }
  state_->owner = this;
}

Context::~Context() {
  if (!state_) return;
  if (currentState == state_.get()) {
    if (state_->emptyVertexArray != 0) glDeleteVertexArrays(1, &state_->emptyVertexArray);
    glDebugMessageCallback(nullptr, nullptr);
    release(std::exchange(currentState, nullptr));
  }
  liveSerials.erase(state_->serial);
}

Context::Context(Context&& other) noexcept : state_(std::move(other.state_)) {
  if (state_) state_->owner = this;
}

Context& Context::operator=(Context&& other) noexcept {
  if (this != &other) {
    Context old(std::move(*this));
    state_ = std::move(other.state_);
    if (state_) state_->owner = this;
  }
  return *this;
}

const DeviceInfo& Context::info() const {
  return state_->info;
}

bool Context::has(const std::string& extension) const {
  return state_->extensions.contains(extension);
}

void Context::makeCurrent() {
  try {
    switchTo(*state_);
  } catch (const PlatformFailure& failure) {
    throw DeviceError("device " + state_->info.device + " was lost: " + failure.message);
  }
}

void Context::finish(const char* place) {
  glFinish();
  check(place);
}

void Context::check(const char* place) {
  std::string problems;
  ExitCode code = ExitCode::Internal;
  for (std::size_t i = 0; i < kMaxMessages; ++i) {
    const GLenum error = glGetError();
    if (error == GL_NO_ERROR) break;
    if (error == GL_OUT_OF_MEMORY) code = ExitCode::OutOfMemory;
    problems += (problems.empty() ? "" : ", ") + errorName(error);
  }
  std::vector<std::string> messages;
  {
    const std::scoped_lock lock(state_->messagesMutex);
    messages.swap(state_->messages);
  }
  for (const std::string& message : messages) problems += "\n  driver: " + message;
  if (!problems.empty()) {
    throw Error(code, "OpenGL reports an error in " + std::string(place) + ": " + problems + " (" +
                          state_->info.renderer + ")");
  }
}

Context& Context::current() {
  if (currentState == nullptr || currentState->owner == nullptr) {
    throw std::logic_error("no GL context is current");
  }
  return *currentState->owner;
}

bool Context::hasCurrent() {
  return currentState != nullptr;
}

std::uint32_t Context::currentSerial() {
  return currentState != nullptr ? currentState->serial : 0;
}

bool contextIsAlive(std::uint32_t serial) {
  return liveSerials.contains(serial);
}

ProbedDevice probeDevice(Platform platform, int index) {
  // This process is about to end: the context stays.
  const Context::State* state = open(platform, index).release();
  return {state->info, state->extensions};
}

GLuint emptyVertexArray() {
  if (currentState == nullptr) throw std::logic_error("no GL context is current");
  if (currentState->emptyVertexArray == 0) {
    glCreateVertexArrays(1, &currentState->emptyVertexArray);
  }
  return currentState->emptyVertexArray;
}

void checkErrors(const char* place) {
  Context::current().check(place);
}

}  // namespace catoptric::gl
