#include "gl/headless.hpp"

#include "error.hpp"

#include <epoxy/egl.h>

#include <array>
#include <dlfcn.h>

namespace paradize::gl {

namespace {

/// Creates a surfaceless OpenGL 3.3 core context on an initialised display. Returns EGL_NO_CONTEXT on
/// failure.
EGLContext make_context(EGLDisplay display, bool debug) {
    if (eglBindAPI(EGL_OPENGL_API) != EGL_TRUE ||
        !epoxy_has_egl_extension(display, "EGL_KHR_surfaceless_context")) {
        return EGL_NO_CONTEXT;
    }
    const std::array<EGLint, 5> wanted{EGL_RENDERABLE_TYPE, EGL_OPENGL_BIT, EGL_SURFACE_TYPE, 0, EGL_NONE};
    EGLConfig config = EGL_NO_CONFIG_KHR;
    EGLint count = 0;
    if (eglChooseConfig(display, wanted.data(), &config, 1, &count) != EGL_TRUE || count == 0) {
        return EGL_NO_CONTEXT;
    }
    const std::array<EGLint, 9> attributes{EGL_CONTEXT_MAJOR_VERSION,
                                           3,
                                           EGL_CONTEXT_MINOR_VERSION,
                                           3,
                                           EGL_CONTEXT_OPENGL_PROFILE_MASK,
                                           EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT,
                                           EGL_CONTEXT_OPENGL_DEBUG,
                                           debug ? EGL_TRUE : EGL_FALSE,
                                           EGL_NONE};
    return eglCreateContext(display, config, EGL_NO_CONTEXT, attributes.data());
}

} // namespace

HeadlessContext::HeadlessContext(bool debug) {
    // Without libEGL, epoxy would end the process.
    if (::dlopen("libEGL.so.1", RTLD_LAZY | RTLD_GLOBAL) == nullptr) {
        throw Error("there is no libEGL.so.1 to draw without a display; install it (Debian: libegl1)");
    }
    const auto attempt = [&](EGLenum platform, void *native) {
        const EGLDisplay display = eglGetPlatformDisplayEXT(platform, native, nullptr);
        if (display == EGL_NO_DISPLAY || eglInitialize(display, nullptr, nullptr) != EGL_TRUE) {
            return false;
        }
        const EGLContext context = make_context(display, debug);
        if (context != EGL_NO_CONTEXT &&
            eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, context) == EGL_TRUE) {
            display_ = display;
            context_ = context;
            return true;
        }
        if (context != EGL_NO_CONTEXT) {
            eglDestroyContext(display, context);
        }
        eglTerminate(display);
        return false;
    };
    if (epoxy_has_egl_extension(EGL_NO_DISPLAY, "EGL_EXT_platform_base")) {
        // Devices first, so that a graphics card is used if there is one. Mesa lists its software device
        // last.
        if (epoxy_has_egl_extension(EGL_NO_DISPLAY, "EGL_EXT_device_enumeration") &&
            epoxy_has_egl_extension(EGL_NO_DISPLAY, "EGL_EXT_platform_device")) {
            std::array<EGLDeviceEXT, 16> devices{};
            EGLint count = 0;
            eglQueryDevicesEXT(static_cast<EGLint>(devices.size()), devices.data(), &count);
            for (EGLint i = 0; i < count; ++i) {
                if (attempt(EGL_PLATFORM_DEVICE_EXT, devices[static_cast<std::size_t>(i)])) {
                    return;
                }
            }
        }
        if (epoxy_has_egl_extension(EGL_NO_DISPLAY, "EGL_MESA_platform_surfaceless") &&
            attempt(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY)) {
            return;
        }
    }
    throw Error("EGL offers no OpenGL 3.3 core context without a display; install a driver (Debian: libegl1, "
                "libgl1-mesa-dri) or run with a display and without --headless");
}

HeadlessContext::~HeadlessContext() {
    eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
    eglDestroyContext(display_, context_);
    // The display belongs to the whole process. Terminating it would unload the driver under other contexts.
}

} // namespace paradize::gl
