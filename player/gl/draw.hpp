#pragma once
// Draw calls, counted.

#include <cstddef>
#include <cstdint>
#include <span>

namespace paradize::gl {

/// Draws triangles of the bound vertex array. `index_type` is GL_UNSIGNED_SHORT or GL_UNSIGNED_INT,
/// `offset_bytes` lies in its index buffer.
void draw_triangles(int index_count, unsigned index_type, std::size_t offset_bytes, int instances = 1);
/// Draws several ranges of triangles in one call. All spans have the same length.
void draw_triangle_ranges(std::span<const int> index_counts, unsigned index_type,
                          std::span<const void *const> offsets, std::span<const int> base_vertices);
/// Draws vertices without indices. `mode` is GL_TRIANGLES, GL_TRIANGLE_STRIP and so on.
void draw_vertices(unsigned mode, int vertices, int instances = 1);

/// Returns the number of draw calls of this process so far.
std::uint64_t draw_calls();

} // namespace paradize::gl
