#pragma once
// Draw calls, counted.

#include <cstddef>
#include <cstdint>
#include <span>

namespace paradize::gl {

/// One of the draws of an indirect call, as glMultiDrawElementsIndirect reads it.
struct IndirectDraw {
    std::uint32_t index_count = 0, instances = 1;
    std::uint32_t first_index = 0;
    std::int32_t base_vertex = 0;
    std::uint32_t first_instance = 0;
};
static_assert(sizeof(IndirectDraw) == 20);

/// True if the context has indirect calls of many draws whose instances begin anywhere (OpenGL 4.3, or
/// ARB_multi_draw_indirect and ARB_base_instance).
bool has_indirect_draws();
/// Draws triangles of the bound vertex array: `count` draws of the bound indirect buffer, from entry `first`
/// on, in one call. `index_type` is GL_UNSIGNED_SHORT or GL_UNSIGNED_INT.
void draw_indirect(unsigned index_type, std::size_t first, std::size_t count);
/// Draws triangles of the bound vertex array. Its instances begin at the bound ones, whatever the draw says.
void draw_triangles(const IndirectDraw &draw, unsigned index_type);
/// Draws several ranges of triangles in one call. All spans have the same length.
void draw_triangle_ranges(std::span<const int> index_counts, unsigned index_type,
                          std::span<const void *const> offsets, std::span<const int> base_vertices);
/// Draws vertices without indices. `mode` is GL_TRIANGLES, GL_TRIANGLE_STRIP and so on.
void draw_vertices(unsigned mode, int vertices, int instances = 1);

/// While it lives and `on`, depth is tested after the fragment shader, whose alpha must be 1 or mean
/// coverage. The framebuffer has a stencil, whose values are lost. For llvmpipe: where pixels have several
/// samples it shades all 4 x 4 pixels of a block that a triangle touches, hidden or not; with a late test it
/// leaves out the half that the triangle does not touch (Mesa 22.3, generate_fs_loop of lp_state_fs.c). It
/// tests late where alpha becomes coverage and a stencil is written. The picture is the same.
class LateDepthTest {
  public:
    explicit LateDepthTest(bool on);
    ~LateDepthTest();
    LateDepthTest(const LateDepthTest &) = delete;
    LateDepthTest &operator=(const LateDepthTest &) = delete;

  private:
    bool on_;
};

/// Returns the number of draw calls of this process so far.
std::uint64_t draw_calls();

} // namespace paradize::gl
