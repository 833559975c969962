#include "context.hpp"

#include "error.hpp"
#include "gl/debug.hpp"
#include "gl/headless.hpp"
#include "gl/uniform_check.hpp"

#include <doctest/doctest.h>

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

} // namespace paradize::test
