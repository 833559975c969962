#include "context.hpp"

#include "error.hpp"
#include "gl/debug.hpp"
#include "gl/headless.hpp"
#include "gl/uniform_check.hpp"

#include <doctest/doctest.h>
#include <epoxy/gl.h>

#include <algorithm>
#include <memory>
#include <utility>

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
    unsigned last = 4095;
    for (const auto &[make, remove] :
         {std::pair(glGenTextures, glDeleteTextures), std::pair(glGenBuffers, glDeleteBuffers),
          std::pair(glGenVertexArrays, glDeleteVertexArrays),
          std::pair(glGenFramebuffers, glDeleteFramebuffers), std::pair(glGenSamplers, glDeleteSamplers),
          std::pair(glGenRenderbuffers, glDeleteRenderbuffers)}) {
        unsigned next = 0;
        make(1, &next);
        remove(1, &next);
        last = std::max(last, next);
    }
    const unsigned program = glCreateProgram();
    glDeleteProgram(program);
    return std::max(last, program) + 1;
}

} // namespace paradize::test
