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

bool has_indirect_draws() {
    return epoxy_has_gl_extension("GL_ARB_multi_draw_indirect") &&
           epoxy_has_gl_extension("GL_ARB_base_instance");
}

void draw_indirect(unsigned index_type, std::size_t first, std::size_t count) {
    begin_call();
    glMultiDrawElementsIndirect(GL_TRIANGLES, index_type,
                                reinterpret_cast<const void *>(first * sizeof(IndirectDraw)),
                                static_cast<GLsizei>(count), 0);
}

void draw_triangles(const IndirectDraw &draw, unsigned index_type) {
    begin_call();
    const std::size_t index_bytes = index_type == GL_UNSIGNED_SHORT ? 2 : 4;
    glDrawElementsInstancedBaseVertex(GL_TRIANGLES, static_cast<GLsizei>(draw.index_count), index_type,
                                      reinterpret_cast<const void *>(draw.first_index * index_bytes),
                                      static_cast<GLsizei>(draw.instances), draw.base_vertex);
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

LateDepthTest::LateDepthTest(bool on) : on_(on) {
    if (on_) {
        glEnable(GL_SAMPLE_ALPHA_TO_COVERAGE);
        glEnable(GL_STENCIL_TEST);
        glStencilOp(GL_KEEP, GL_KEEP, GL_REPLACE);
    }
}

LateDepthTest::~LateDepthTest() {
    if (on_) {
        glDisable(GL_STENCIL_TEST);
        glDisable(GL_SAMPLE_ALPHA_TO_COVERAGE);
    }
}

std::uint64_t draw_calls() {
    return calls;
}

} // namespace paradize::gl
