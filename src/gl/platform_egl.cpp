// EGL without a window system: on one of its devices, or Mesa's surfaceless platform.
#define EGL_NO_X11  // no X11 headers wanted
#include <EGL/egl.h>
#include <EGL/eglext.h>

#include <array>
#include <sstream>

#include "gl/platform_library.h"

namespace catoptric::gl {
namespace {

constexpr const char* kEglLibrary = "libEGL.so.1";

struct EglLibrary {
  void* handle = nullptr;
  std::string clientExtensions;
  decltype(&eglGetProcAddress) getProcAddress = nullptr;
  decltype(&eglQueryString) queryString = nullptr;
  decltype(&eglGetError) getError = nullptr;
  decltype(&eglInitialize) initialize = nullptr;
  decltype(&eglBindAPI) bindApi = nullptr;
  decltype(&eglChooseConfig) chooseConfig = nullptr;
  decltype(&eglCreateContext) createContext = nullptr;
  decltype(&eglDestroyContext) destroyContext = nullptr;
  decltype(&eglMakeCurrent) makeCurrent = nullptr;
  PFNEGLGETPLATFORMDISPLAYEXTPROC getPlatformDisplay = nullptr;
  PFNEGLQUERYDEVICESEXTPROC queryDevices = nullptr;
  PFNEGLQUERYDEVICESTRINGEXTPROC queryDeviceString = nullptr;
};

bool hasWord(const std::string& list, const char* word) {
  std::istringstream stream(list);
  for (std::string item; stream >> item;) {
    if (item == word) return true;
  }
  return false;
}

const EglLibrary& eglLibrary() {
  static EglLibrary loaded;
  if (loaded.handle != nullptr) return loaded;
  EglLibrary fresh;
  void* handle =
      openLibrary(kEglLibrary, "install libegl1 and a driver (libegl-mesa0, or NVIDIA's)");
  fresh.handle = handle;
  const auto find = [&](const char* name, auto& function) {
    findFunction(handle, kEglLibrary, name, "install libegl1", function);
  };
  find("eglGetProcAddress", fresh.getProcAddress);
  find("eglQueryString", fresh.queryString);
  find("eglGetError", fresh.getError);
  find("eglInitialize", fresh.initialize);
  find("eglBindAPI", fresh.bindApi);
  find("eglChooseConfig", fresh.chooseConfig);
  find("eglCreateContext", fresh.createContext);
  find("eglDestroyContext", fresh.destroyContext);
  find("eglMakeCurrent", fresh.makeCurrent);
  const char* extensions = fresh.queryString(EGL_NO_DISPLAY, EGL_EXTENSIONS);
  fresh.clientExtensions = extensions != nullptr ? extensions : "";
  fresh.getPlatformDisplay = reinterpret_cast<PFNEGLGETPLATFORMDISPLAYEXTPROC>(
      fresh.getProcAddress("eglGetPlatformDisplayEXT"));
  fresh.queryDevices =
      reinterpret_cast<PFNEGLQUERYDEVICESEXTPROC>(fresh.getProcAddress("eglQueryDevicesEXT"));
  fresh.queryDeviceString = reinterpret_cast<PFNEGLQUERYDEVICESTRINGEXTPROC>(
      fresh.getProcAddress("eglQueryDeviceStringEXT"));
  loaded = fresh;
  return loaded;
}

std::string eglErrorName(EGLint error) {
  switch (error) {
    case EGL_SUCCESS:
      return "no error given";
    case EGL_NOT_INITIALIZED:
      return "EGL_NOT_INITIALIZED";
    case EGL_BAD_ACCESS:
      return "EGL_BAD_ACCESS";
    case EGL_BAD_ALLOC:
      return "EGL_BAD_ALLOC";
    case EGL_BAD_ATTRIBUTE:
      return "EGL_BAD_ATTRIBUTE";
    case EGL_BAD_CONFIG:
      return "EGL_BAD_CONFIG";
    case EGL_BAD_CONTEXT:
      return "EGL_BAD_CONTEXT";
    case EGL_BAD_DISPLAY:
      return "EGL_BAD_DISPLAY";
    case EGL_BAD_MATCH:
      return "EGL_BAD_MATCH";
    case EGL_BAD_PARAMETER:
      return "EGL_BAD_PARAMETER";
    default: {
      std::ostringstream text;
      text << "EGL error 0x" << std::hex << error;
      return text.str();
    }
  }
}

constexpr const char* kCheckAccess =
    "check the driver's installation and the permissions of /dev/dri and /dev/nvidia*, or use "
    "another device";

std::vector<EGLDeviceEXT> devicesOf(const EglLibrary& egl) {
  if (egl.queryDevices == nullptr || egl.getPlatformDisplay == nullptr ||
      !hasWord(egl.clientExtensions, "EGL_EXT_platform_device")) {
    throw PlatformFailure{"EGL has no EGL_EXT_platform_device",
                          "install a driver that has it (Mesa 19 or newer, NVIDIA), or use "
                          "surfaceless or osmesa"};
  }
  EGLint count = 0;
  if (!egl.queryDevices(0, nullptr, &count)) {
    throw PlatformFailure{"eglQueryDevicesEXT failed: " + eglErrorName(egl.getError()),
                          kCheckAccess};
  }
  std::vector<EGLDeviceEXT> devices(static_cast<std::size_t>(count));
  if (count > 0 && !egl.queryDevices(count, devices.data(), &count)) {
    throw PlatformFailure{"eglQueryDevicesEXT failed: " + eglErrorName(egl.getError()),
                          kCheckAccess};
  }
  devices.resize(static_cast<std::size_t>(count));
  return devices;
}

class EglContext : public PlatformContext {
 public:
  EglContext(EGLenum platform, void* native) : egl_(eglLibrary()) {
    if (egl_.getPlatformDisplay == nullptr) {
      throw PlatformFailure{"EGL has no EGL_EXT_platform_base", "install a newer libegl1"};
    }
    display_ = egl_.getPlatformDisplay(platform, native, nullptr);
    if (display_ == EGL_NO_DISPLAY) {
      throw PlatformFailure{
          "eglGetPlatformDisplay gave no display: " + eglErrorName(egl_.getError()), kCheckAccess};
    }
    EGLint major = 0;
    EGLint minor = 0;
    if (!egl_.initialize(display_, &major, &minor)) {
      throw PlatformFailure{"eglInitialize failed: " + eglErrorName(egl_.getError()), kCheckAccess};
    }
    create();
  }
  // The display stays initialized, like the eglLibrary: the driver would be unloaded and loaded
  // again for the next context.
  ~EglContext() override { egl_.destroyContext(display_, context_); }
  EglContext(const EglContext&) = delete;
  EglContext& operator=(const EglContext&) = delete;

  void makeCurrent() override {
    // The API is a state of the thread, and release() depends on it as well.
    egl_.bindApi(EGL_OPENGL_API);
    if (!egl_.makeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, context_)) {
      throw PlatformFailure{"eglMakeCurrent failed: " + eglErrorName(egl_.getError()),
                            kCheckAccess};
    }
  }
  void release() noexcept override {
    egl_.makeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
  }
  void* function(const char* name) const override {
    return reinterpret_cast<void*>(egl_.getProcAddress(name));
  }
  std::string version() const override {
    return "EGL " + text(EGL_VERSION) + ", " + text(EGL_VENDOR);
  }

 private:
  std::string text(EGLint name) const {
    const char* value = egl_.queryString(display_, name);
    return value != nullptr ? value : "unknown";
  }

  void create() {
    const std::string extensions = text(EGL_EXTENSIONS);
    if (!hasWord(extensions, "EGL_KHR_surfaceless_context")) {
      throw PlatformFailure{"the display has no EGL_KHR_surfaceless_context",
                            "install a newer driver, or use osmesa"};
    }
    if (!egl_.bindApi(EGL_OPENGL_API)) {
      throw PlatformFailure{"the display has no OpenGL (eglBindAPI failed)",
                            "install a driver with desktop OpenGL, or use osmesa"};
    }
    // No surface is ever drawn to, so no config is needed where EGL allows that.
    EGLConfig config = EGL_NO_CONFIG_KHR;
    if (!hasWord(extensions, "EGL_KHR_no_config_context")) {
      const std::array<EGLint, 5> wanted = {EGL_SURFACE_TYPE, 0, EGL_RENDERABLE_TYPE,
                                            EGL_OPENGL_BIT, EGL_NONE};
      EGLint count = 0;
      if (!egl_.chooseConfig(display_, wanted.data(), &config, 1, &count) || count < 1) {
        throw PlatformFailure{"the display has no config for OpenGL",
                              "install a driver with desktop OpenGL, or use osmesa"};
      }
    }
    const std::array<EGLint, 7> attributes = {EGL_CONTEXT_MAJOR_VERSION,
                                              4,
                                              EGL_CONTEXT_MINOR_VERSION,
                                              5,
                                              EGL_CONTEXT_OPENGL_PROFILE_MASK,
                                              EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT,
                                              EGL_NONE};
    context_ = egl_.createContext(display_, config, EGL_NO_CONTEXT, attributes.data());
    if (context_ == EGL_NO_CONTEXT) {
      throw PlatformFailure{
          "no OpenGL 4.5 core context: " + eglErrorName(egl_.getError()),
          "install a driver with OpenGL 4.5 (Mesa 20 or newer), and unset GALLIUM_DRIVER and "
          "MESA_GL_VERSION_OVERRIDE"};
    }
  }

  const EglLibrary& egl_;
  EGLDisplay display_ = EGL_NO_DISPLAY;
  EGLContext context_ = EGL_NO_CONTEXT;
};

}  // namespace

std::vector<EglDeviceEntry> listEglDevices() {
  const EglLibrary& egl = eglLibrary();
  std::vector<EglDeviceEntry> entries;
  for (const EGLDeviceEXT device : devicesOf(egl)) {
    EglDeviceEntry entry;
    entry.index = static_cast<int>(entries.size());
    const char* extensions =
        egl.queryDeviceString != nullptr ? egl.queryDeviceString(device, EGL_EXTENSIONS) : nullptr;
    const std::string words = extensions != nullptr ? extensions : "";
    entry.software = hasWord(words, "EGL_MESA_device_software");
    entry.description = entry.software ? "software" : "device";
    if (hasWord(words, "EGL_EXT_device_drm")) {
      const char* file = egl.queryDeviceString(device, EGL_DRM_DEVICE_FILE_EXT);
      if (file != nullptr) entry.description = file;
    }
    entries.push_back(entry);
  }
  return entries;
}

std::unique_ptr<PlatformContext> makeEglContext(Platform platform, int index) {
  const EglLibrary& egl = eglLibrary();
  if (platform == Platform::EglSurfaceless) {
    if (!hasWord(egl.clientExtensions, "EGL_MESA_platform_surfaceless")) {
      throw PlatformFailure{
          "EGL has no EGL_MESA_platform_surfaceless",
          "install libegl-mesa0 and libgl1-mesa-dri; NVIDIA's driver needs egl:N"};
    }
    return std::make_unique<EglContext>(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY);
  }
  const std::vector<EGLDeviceEXT> devices = devicesOf(egl);
  if (index >= static_cast<int>(devices.size())) {
    std::string range = devices.empty() ? "EGL lists no devices"
                        : devices.size() == 1
                            ? "EGL lists one device, egl:0"
                            : "EGL lists egl:0 to egl:" + std::to_string(devices.size() - 1);
    throw PlatformFailure{"there is no egl:" + std::to_string(index) + " (" + range + ")",
                          devices.empty() ? "install a GPU's driver, or use surfaceless or osmesa"
                                          : "use one of those, surfaceless or osmesa"};
  }
  return std::make_unique<EglContext>(EGL_PLATFORM_DEVICE_EXT, devices[index]);
}

}  // namespace catoptric::gl
