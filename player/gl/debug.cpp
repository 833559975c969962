#include "gl/debug.hpp"

#include "error.hpp"

#include <epoxy/gl.h>

#include <utility>

namespace paradize::gl {

namespace {

void GLAPIENTRY on_message(GLenum /*source*/, GLenum type, GLuint /*id*/, GLenum severity, GLsizei /*length*/,
                           const GLchar *message, const void *log) {
    if (type == GL_DEBUG_TYPE_ERROR || severity == GL_DEBUG_SEVERITY_HIGH) {
        // install() passed this pointer, and it is not const there
        static_cast<DebugLog *>(const_cast<void *>(log))->record(message);
    }
}

std::string gl_string(GLenum name) {
    const GLubyte *text = glGetString(name);
    return text == nullptr ? std::string("unknown") : std::string(reinterpret_cast<const char *>(text));
}

} // namespace

bool DebugLog::install() {
    if (!epoxy_has_gl_extension("GL_KHR_debug")) {
        return false;
    }
    glEnable(GL_DEBUG_OUTPUT);
    glEnable(GL_DEBUG_OUTPUT_SYNCHRONOUS);
    glDebugMessageCallback(on_message, this);
    return true;
}

void DebugLog::record(const char *message) {
    if (errors_++ == 0) {
        first_ = message;
    }
}

void DebugLog::throw_on_error() {
    if (const GLenum code = glGetError(); code != GL_NO_ERROR && errors_ == 0) {
        record(("error " + std::to_string(code)).c_str());
    }
    if (const std::uint64_t count = std::exchange(errors_, 0); count != 0) {
        throw Error("the graphics driver reports errors (" + std::to_string(count) +
                    "), the first: " + first_);
    }
}

void check_memory() {
    if (glGetError() == GL_OUT_OF_MEMORY) {
        throw Error(
            "the graphics driver is out of memory for this scene; bake it with smaller maps, or use a "
            "smaller --size");
    }
}

std::string renderer_name() {
    return gl_string(GL_RENDERER);
}

std::string version_name() {
    return gl_string(GL_VERSION);
}

bool software_renderer() {
    const std::string name = renderer_name();
    for (const char *word : {"llvmpipe", "softpipe", "SwiftShader", "Software"}) {
        if (name.find(word) != std::string::npos) {
            return true;
        }
    }
    return false;
}

} // namespace paradize::gl
