#pragma once
// Buffers and vertex arrays.

#include "gl/handle.hpp"

#include <cstddef>
#include <span>

namespace paradize::gl {

/// Fixed places of vertex attributes, the same in every shader: layout(location = N).
enum Attribute : unsigned {
    attribute_position = 0, // vec3, metres, or codes of the mesh's lattice
    attribute_normal = 1,   // vec3, unit
    attribute_tangent = 2,  // vec4, xyz unit, w = +-1
    attribute_uv0 = 3,      // vec2, origin at the top left texel corner
    attribute_uv1 = 4,      // vec2
    attribute_color = 5,    // vec4, linear
    attribute_free = 6,     // first place that no baked mesh uses: per-instance data of a pass
};

enum class Usage { fixed, streamed };

/// A buffer of `bytes` bytes without contents. `target` is GL_ARRAY_BUFFER, GL_ELEMENT_ARRAY_BUFFER ...
/// Leaves it bound (an element buffer: unbind the vertex array first).
Buffer make_buffer(unsigned target, std::size_t bytes, Usage usage);
/// Writes into a buffer made by make_buffer; offset + data must lie inside it.
void write_buffer(unsigned target, const Buffer &buffer, std::size_t offset, std::span<const std::byte> data);

/// One float attribute of the vertex array that is bound, read from `buffer`; `divisor` 1 advances per
/// instance.
void attribute_floats(unsigned location, int components, const Buffer &buffer, int stride_bytes,
                      std::size_t offset_bytes, unsigned divisor = 0);

/// One attribute of any component type for `buffer`'s vertices; normalized integers reach the shader as 0 to
/// 1 or -1 to 1, others as they are.
void attribute_numbers(unsigned location, int components, unsigned component_type, bool normalized,
                       const Buffer &buffer, int stride_bytes, std::size_t offset_bytes);

} // namespace paradize::gl
