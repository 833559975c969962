#include "gl/handle.hpp"

#include <epoxy/gl.h>

namespace paradize::gl {

unsigned generate(Kind kind) {
    unsigned name = 0;
    switch (kind) {
    case Kind::buffer:
        glGenBuffers(1, &name);
        break;
    case Kind::texture:
        glGenTextures(1, &name);
        break;
    case Kind::vertex_array:
        glGenVertexArrays(1, &name);
        break;
    case Kind::framebuffer:
        glGenFramebuffers(1, &name);
        break;
    case Kind::renderbuffer:
        glGenRenderbuffers(1, &name);
        break;
    case Kind::sampler:
        glGenSamplers(1, &name);
        break;
    case Kind::query:
        glGenQueries(1, &name);
        break;
    case Kind::program:
        name = glCreateProgram();
        break;
    case Kind::shader: // created by Program, because it needs the shader's type
        break;
    }
    return name;
}

void destroy(Kind kind, unsigned name) noexcept {
    if (name == 0) {
        return;
    }
    switch (kind) {
    case Kind::buffer:
        glDeleteBuffers(1, &name);
        break;
    case Kind::texture:
        glDeleteTextures(1, &name);
        break;
    case Kind::vertex_array:
        glDeleteVertexArrays(1, &name);
        break;
    case Kind::framebuffer:
        glDeleteFramebuffers(1, &name);
        break;
    case Kind::renderbuffer:
        glDeleteRenderbuffers(1, &name);
        break;
    case Kind::sampler:
        glDeleteSamplers(1, &name);
        break;
    case Kind::query:
        glDeleteQueries(1, &name);
        break;
    case Kind::program:
        glDeleteProgram(name);
        break;
    case Kind::shader:
        glDeleteShader(name);
        break;
    }
}

} // namespace paradize::gl
