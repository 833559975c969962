#include "gl/timestamp.hpp"

#include "gl/debug.hpp"

#include <epoxy/gl.h>

namespace paradize::gl {

bool has_timestamps() {
    if (software_renderer()) {
        return false;
    }
    GLint bits = 0;
    glGetQueryiv(GL_TIMESTAMP, GL_QUERY_COUNTER_BITS, &bits);
    return bits >= 32;
}

void ask_timestamp(const Query &query) {
    glQueryCounter(query.name(), GL_TIMESTAMP);
}

std::uint64_t read_timestamp(const Query &query) {
    GLuint64 nanoseconds = 0;
    glGetQueryObjectui64v(query.name(), GL_QUERY_RESULT, &nanoseconds);
    return nanoseconds;
}

} // namespace paradize::gl
