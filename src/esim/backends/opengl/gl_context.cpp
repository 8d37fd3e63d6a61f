#include "esim/backends/opengl/gl_context.h"

#include <dlfcn.h>
#include <epoxy/egl.h>
#include <epoxy/gl.h>

#include <algorithm>
#include <array>
#include <string_view>
#include <vector>

#include "esim/backends/opengl/gl_renderer.h"
#include "esim/core/error.h"

namespace esim::inline backends::inline opengl {
namespace {

constexpr const char* kInstall =
    "install the graphics driver's EGL, or Mesa's (Debian: libegl1 libgl1-mesa-dri), or use engine: raycast";

/// libepoxy terminates the process if a library is missing, so this checks for the libraries first.
bool is_installed() {
  for (const char* library : {"libEGL.so.1", "libOpenGL.so.0"}) {
    void* const handle = dlopen(library, RTLD_LAZY | RTLD_LOCAL);
    if (handle == nullptr && std::string_view(library) == "libOpenGL.so.0") {
      if (dlopen("libGL.so.1", RTLD_LAZY | RTLD_LOCAL) != nullptr) continue;
    }
    if (handle == nullptr) return false;
  }
  return true;
}

/// A display for each device that EGL lists, or Mesa's surfaceless display if it cannot list devices.
std::vector<EGLDisplay> displays() {
  std::vector<EGLDisplay> found;
  if (!is_installed()) return found;
  if (epoxy_has_egl_extension(EGL_NO_DISPLAY, "EGL_EXT_platform_device") &&
      epoxy_has_egl_extension(EGL_NO_DISPLAY, "EGL_EXT_device_enumeration")) {
    std::array<EGLDeviceEXT, 32> devices;
    EGLint count = 0;
    if (eglQueryDevicesEXT(static_cast<EGLint>(devices.size()), devices.data(), &count) == EGL_FALSE) count = 0;
    for (EGLint i = 0; i < count; ++i)
      found.push_back(eglGetPlatformDisplayEXT(EGL_PLATFORM_DEVICE_EXT, devices[static_cast<std::size_t>(i)], nullptr));
  } else if (epoxy_has_egl_extension(EGL_NO_DISPLAY, "EGL_MESA_platform_surfaceless")) {
    found.push_back(eglGetPlatformDisplayEXT(EGL_PLATFORM_SURFACELESS_MESA, nullptr, nullptr));
  }
  return found;
}

/// Null if the device does not support OpenGL 4.5.
EGLContext create_context(EGLDisplay display) {
  if (display == EGL_NO_DISPLAY || eglInitialize(display, nullptr, nullptr) == EGL_FALSE) return EGL_NO_CONTEXT;
  if (!epoxy_has_egl_extension(display, "EGL_KHR_no_config_context") ||
      !epoxy_has_egl_extension(display, "EGL_KHR_surfaceless_context") || eglBindAPI(EGL_OPENGL_API) == EGL_FALSE) {
    return EGL_NO_CONTEXT;
  }
  constexpr EGLint kAttributes[] = {
      EGL_CONTEXT_MAJOR_VERSION,           4,       EGL_CONTEXT_MINOR_VERSION, 5, EGL_CONTEXT_OPENGL_PROFILE_MASK,
      EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT, EGL_NONE};
  return eglCreateContext(display, EGL_NO_CONFIG_KHR, EGL_NO_CONTEXT, kAttributes);
}

bool is_software(std::string_view renderer) {
  constexpr std::array<std::string_view, 4> kNames = {"llvmpipe", "softpipe", "swrast", "SwiftShader"};
  return std::any_of(kNames.begin(), kNames.end(),
                     [&](std::string_view name) { return renderer.find(name) != std::string_view::npos; });
}

/// The device of the current context.
std::string current_device() {
  const GLubyte* const name = glGetString(GL_RENDERER);
  return name != nullptr ? reinterpret_cast<const char*>(name) : "unknown";
}

}  // namespace

/// A context and its device.
struct GlContext::Handles {
  EGLDisplay display;  // shared by the process, and never closed, since others may use it
  EGLContext context;
  std::string name;
  bool software = false;

  explicit Handles(EGLDisplay on) : display(on), context(create_context(on)) {}
  ~Handles() {
    if (context != EGL_NO_CONTEXT) eglDestroyContext(display, context);
  }
};

namespace {

/// The thread's previous context, to be restored.
struct CurrentContext {
  EGLDisplay display = eglGetCurrentDisplay();
  EGLContext context = eglGetCurrentContext();
  EGLSurface draw = eglGetCurrentSurface(EGL_DRAW), read = eglGetCurrentSurface(EGL_READ);

  void put_back(EGLDisplay instead_of) const {
    if (context != EGL_NO_CONTEXT) {
      eglMakeCurrent(display, draw, read, context);
    } else {
      eglMakeCurrent(instead_of, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
    }
  }
};

}  // namespace

struct GlContext::Use::Before : CurrentContext {};

GlContext::Use::Use(const GlContext& context) : display_(context.handles_->display), before_(new Before) {
  eglBindAPI(EGL_OPENGL_API);
  if (eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, context.handles_->context) == EGL_FALSE)
    throw UserError("gl: the context cannot be used in this thread; use a renderer in one thread at a time");
}

GlContext::Use::~Use() { before_->put_back(display_); }

/// Null if the device does not support OpenGL 4.5.
std::unique_ptr<GlContext::Handles> GlContext::open(void* display) {
  auto handles = std::make_unique<Handles>(display);
  if (handles->context == EGL_NO_CONTEXT) return nullptr;
  const CurrentContext before;
  if (eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, handles->context) == EGL_FALSE) return nullptr;
  handles->name = current_device();
  handles->software = is_software(handles->name);
  before.put_back(display);
  return handles;
}

GlContext::GlContext(std::optional<int> device) {
  const std::vector<EGLDisplay> all = displays();
  if (all.empty()) throw UserError(std::string("gl: no device supports OpenGL without a window; ") + kInstall);
  const int count = static_cast<int>(all.size());
  if (device && (*device < 0 || *device >= count)) {
    throw UserError("gl_device: device " + std::to_string(*device) + " does not exist; the devices are 0 to " +
                    std::to_string(count - 1));
  }
  for (int i = device.value_or(0); i < (device ? *device + 1 : count); ++i) {
    std::unique_ptr<Handles> found = open(all[static_cast<std::size_t>(i)]);
    if (found && (!handles_ || (handles_->software && !found->software))) handles_ = std::move(found);
  }
  if (!handles_) throw UserError(std::string("gl: no device supports OpenGL 4.5; ") + kInstall);
}

const std::string& GlContext::name() const { return handles_->name; }
bool GlContext::software() const { return handles_->software; }

GlContext::~GlContext() = default;

std::vector<GlDevice> gl_devices() {
  std::vector<GlDevice> devices;
  const int count = static_cast<int>(displays().size());
  for (int i = 0; i < count; ++i) {
    try {
      const GlContext context(i);
      devices.push_back({context.name(), context.software()});
    } catch (const UserError&) {
      devices.push_back({"no OpenGL 4.5", true});
    }
  }
  return devices;
}

void throw_on_gl_error(const char* doing) {
  const GLenum error = glGetError();
  if (error == GL_NO_ERROR) return;
  if (error == GL_OUT_OF_MEMORY) {
    throw UserError(std::string("gl: the device does not have enough memory for ") + doing +
                    "; use smaller textures or a smaller image");
  }
  throw InternalError(std::string("gl: error ") + std::to_string(error) + " while " + doing);
}

}  // namespace esim::inline backends::inline opengl
