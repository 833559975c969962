#include "context.hpp"

#include "error.hpp"
#include "gl/debug.hpp"
#include "gl/headless.hpp"
#include "gl/uniform_check.hpp"

#include <doctest/doctest.h>
#include <epoxy/gl.h>

#include <algorithm>
#include <array>
#include <memory>

namespace paradize::test {

namespace {

struct Context {
    std::unique_ptr<gl::HeadlessContext> context;
    gl::DebugLog log;

    Context() {
        try {
            context = std::make_unique<gl::HeadlessContext>(true);
            log.install();
            gl::check_uniforms();
        } catch (const Error &error) {
            MESSAGE("no GL tests: " << error.what());
        }
    }
};

Context &shared() {
    static Context context;
    return context;
}

} // namespace

bool have_context() {
    return shared().context != nullptr;
}

void throw_on_error() {
    CHECK_NOTHROW(shared().log.throw_on_error());
}

void clear_errors() {
    try {
        shared().log.throw_on_error();
    } catch (const Error &) { // as documented
    }
}

unsigned names_end() {
    std::array<unsigned, 8> next{4096};
    glGenTextures(1, &next[1]);
    glDeleteTextures(1, &next[1]);
    glGenBuffers(1, &next[2]);
    glDeleteBuffers(1, &next[2]);
    glGenVertexArrays(1, &next[3]);
    glDeleteVertexArrays(1, &next[3]);
    glGenFramebuffers(1, &next[4]);
    glDeleteFramebuffers(1, &next[4]);
    glGenSamplers(1, &next[5]);
    glDeleteSamplers(1, &next[5]);
    glGenRenderbuffers(1, &next[6]);
    glDeleteRenderbuffers(1, &next[6]);
    next[7] = glCreateProgram();
    glDeleteProgram(next[7]);
    return std::ranges::max(next);
}

} // namespace paradize::test
