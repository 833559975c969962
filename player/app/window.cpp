#include "app/window.hpp"

#include "error.hpp"

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>

#include <algorithm>
#include <utility>

namespace paradize {

namespace {
constexpr double longest_wait_s = 0.05;
}

struct Window::Impl {
    GLFWwindow *window = nullptr;
    Input input;
    bool captured = false;
    bool mouse_known = false;
    double mouse_x = 0.0, mouse_y = 0.0;

    static Impl &of(GLFWwindow *window) { return *static_cast<Impl *>(glfwGetWindowUserPointer(window)); }

    static void on_key(GLFWwindow *window, int key, int /*scancode*/, int action, int /*mods*/) {
        if (action != GLFW_PRESS) {
            return;
        }
        Input &input = of(window).input;
        input.any_key = true;
        input.escape = input.escape || key == GLFW_KEY_ESCAPE;
        input.pause = input.pause || key == GLFW_KEY_SPACE;
        input.mute = input.mute || key == GLFW_KEY_M;
        input.next_music = input.next_music || key == GLFW_KEY_N;
        input.volume_steps += key == GLFW_KEY_KP_ADD || key == GLFW_KEY_EQUAL ? 1 : 0;
        input.volume_steps -= key == GLFW_KEY_KP_SUBTRACT || key == GLFW_KEY_MINUS ? 1 : 0;
    }

    static void on_mouse(GLFWwindow *window, double x, double y) {
        Impl &self = of(window);
        if (self.mouse_known) {
            self.input.yaw_px += x - self.mouse_x;
            self.input.pitch_px += y - self.mouse_y;
        }
        self.mouse_known = true;
        self.mouse_x = x;
        self.mouse_y = y;
    }

    float axis(int more, int less) const {
        const auto held = [&](int key) { return glfwGetKey(window, key) == GLFW_PRESS ? 1.0F : 0.0F; };
        return held(more) - held(less);
    }
};

Window::Window(const Settings &settings) : impl_(std::make_unique<Impl>()) {
    const auto fail = [](const char *what) {
        const char *reason = nullptr;
        glfwGetError(&reason);
        const std::string why = reason == nullptr ? "" : std::string(" (") + reason + ")";
        glfwTerminate();
        throw Error(std::string(what) + why + "; add --headless to draw without a display");
    };
    glfwInitHint(GLFW_JOYSTICK_HAT_BUTTONS, GLFW_FALSE);
    if (glfwInit() != GLFW_TRUE) {
        fail("there is no display to open a window on");
    }
    glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 3);
    glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 3);
    glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
    glfwWindowHint(GLFW_OPENGL_FORWARD_COMPAT, GLFW_TRUE);
    glfwWindowHint(GLFW_OPENGL_DEBUG_CONTEXT, settings.debug ? GLFW_TRUE : GLFW_FALSE);
    glfwWindowHint(GLFW_DEPTH_BITS, 0); // the picture is rendered into its own framebuffer
    glfwWindowHint(GLFW_STENCIL_BITS, 0);
    glfwWindowHint(GLFW_VISIBLE, settings.visible ? GLFW_TRUE : GLFW_FALSE);
    impl_->window =
        glfwCreateWindow(settings.width_px, settings.height_px, settings.title.c_str(), nullptr, nullptr);
    if (impl_->window == nullptr) {
        fail("cannot create a window with OpenGL 3.3 core");
    }
    glfwSetWindowUserPointer(impl_->window, impl_.get());
    glfwSetKeyCallback(impl_->window, Impl::on_key);
    glfwSetCursorPosCallback(impl_->window, Impl::on_mouse);
    if (settings.capture_mouse) {
        glfwSetInputMode(impl_->window, GLFW_CURSOR, GLFW_CURSOR_DISABLED);
    }
    glfwMakeContextCurrent(impl_->window);
    glfwSwapInterval(settings.visible ? 1 : 0);
}

Window::~Window() {
    glfwDestroyWindow(impl_->window);
    glfwTerminate();
}

Input Window::poll() {
    glfwPollEvents();
    Input out = std::exchange(impl_->input, Input());
    out.close = glfwWindowShouldClose(impl_->window) == GLFW_TRUE;
    out.right = impl_->axis(GLFW_KEY_D, GLFW_KEY_A);
    out.up = impl_->axis(GLFW_KEY_E, GLFW_KEY_Q);
    out.forward = impl_->axis(GLFW_KEY_W, GLFW_KEY_S);
    out.roll = impl_->axis(GLFW_KEY_X, GLFW_KEY_Z);
    out.fast = glfwGetKey(impl_->window, GLFW_KEY_LEFT_SHIFT) == GLFW_PRESS ||
               glfwGetKey(impl_->window, GLFW_KEY_RIGHT_SHIFT) == GLFW_PRESS;
    return out;
}

void Window::size(int &width_px, int &height_px) const {
    glfwGetFramebufferSize(impl_->window, &width_px, &height_px);
    width_px = std::max(width_px, 1);
    height_px = std::max(height_px, 1);
}

bool Window::minimised() const {
    return glfwGetWindowAttrib(impl_->window, GLFW_ICONIFIED) == GLFW_TRUE;
}

void Window::wait() {
    glfwWaitEventsTimeout(longest_wait_s);
}

void Window::set_title(const std::string &title) {
    glfwSetWindowTitle(impl_->window, title.c_str());
}

void Window::swap() {
    glfwSwapBuffers(impl_->window);
}

double Window::seconds() const {
    return glfwGetTime();
}

} // namespace paradize
