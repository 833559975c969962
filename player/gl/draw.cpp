#include "gl/draw.hpp"

#include "gl/uniform_check.hpp"

#include <epoxy/gl.h>

namespace paradize::gl {

namespace {

std::uint64_t calls = 0; // all GL calls come from one thread

void begin_call() {
    ++calls;
    find_marked_uniforms();
}

} // namespace

void draw_triangles(int index_count, unsigned index_type, std::size_t offset_bytes, int instances) {
    begin_call();
    const void *const offset = reinterpret_cast<const void *>(offset_bytes);
    if (instances == 1) {
        glDrawElements(GL_TRIANGLES, index_count, index_type, offset);
    } else {
        glDrawElementsInstanced(GL_TRIANGLES, index_count, index_type, offset, instances);
    }
}

void draw_triangle_ranges(std::span<const int> index_counts, unsigned index_type,
                          std::span<const void *const> offsets, std::span<const int> base_vertices) {
    begin_call();
    glMultiDrawElementsBaseVertex(GL_TRIANGLES, index_counts.data(), index_type, offsets.data(),
                                  static_cast<GLsizei>(index_counts.size()), base_vertices.data());
}

void draw_vertices(unsigned mode, int vertices, int instances) {
    begin_call();
    glDrawArraysInstanced(mode, 0, vertices, instances);
}

std::uint64_t draw_calls() {
    return calls;
}

} // namespace paradize::gl
