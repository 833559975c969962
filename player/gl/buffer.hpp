#pragma once
// Creates and fills buffers, and describes vertex attributes.

#include "gl/handle.hpp"

#include <cstddef>
#include <span>

namespace paradize::gl {

/// Locations of the vertex attributes, the same in every shader: layout(location = N).
enum Attribute : unsigned {
    attribute_position = 0, // vec3, metres or quantised values on the mesh's quantisation grid
    attribute_normal = 1,   // vec3, unit
    attribute_tangent = 2,  // vec4, xyz unit, w = +-1
    attribute_uv0 = 3,      // vec2, origin at the top left texel corner
    attribute_uv1 = 4,      // vec2
    attribute_color = 5,    // vec4, linear
    attribute_sway = 6,     // vec2, shares of lean and flutter
    attribute_free = 7,     // first location that no baked mesh uses, for per-instance data of a pass
    attribute_model = 7, // 4 x vec4 of the objects pass: rows of the matrix from the mesh to the view; beat
};

enum class Usage { fixed, streamed };

/// Creates a buffer of `bytes` bytes with undefined content and leaves it bound. `target` is GL_ARRAY_BUFFER,
/// GL_ELEMENT_ARRAY_BUFFER and so on. Unbind the vertex array before you create an element buffer.
Buffer make_buffer(unsigned target, std::size_t bytes, Usage usage);
/// Writes into a buffer from make_buffer(). `offset` plus the size of `data` must not exceed the buffer.
void write_buffer(unsigned target, const Buffer &buffer, std::size_t offset, std::span<const std::byte> data);

/// Bytes to upload.
struct Source {
    const std::byte *bytes = nullptr;
    unsigned buffer = 0; // not 0: this buffer holds them too, from `offset` on; the device copies them
    std::size_t offset = 0;
};
/// The same from a source.
void write_buffer(unsigned target, const Buffer &buffer, std::size_t offset, const Source &from,
                  std::size_t bytes);

/// Copies bytes from one buffer into another on the device.
void copy_buffer(const Buffer &from, std::size_t from_offset, const Buffer &to, std::size_t to_offset,
                 std::size_t bytes);

/// Maps new, undefined content of a buffer, for refill_buffer(). nullptr: out of memory.
std::byte *map_new_content(unsigned target, const Buffer &buffer, std::size_t bytes);
/// False: the device lost what was written.
bool unmap(unsigned target);

/// Replaces the whole content of a buffer. What earlier draw calls read of it stays as it was.
void replace_buffer(unsigned target, const Buffer &buffer, std::span<const std::byte> data);

/// The same with content that write(bytes) writes into the device's memory, each byte once. False: the
/// content is undefined, out of memory or lost by the device.
template <class Write>
bool refill_buffer(unsigned target, const Buffer &buffer, std::size_t bytes, const Write &write) {
    std::byte *const mapped = map_new_content(target, buffer, bytes);
    if (mapped == nullptr) {
        return false;
    }
    write(mapped);
    return unmap(target);
}

/// Sets a float attribute of the bound vertex array, read from `buffer`. `divisor` 1 advances it once per
/// instance.
void attribute_floats(unsigned location, int components, const Buffer &buffer, int stride_bytes,
                      std::size_t offset_bytes, unsigned divisor = 0);

/// Sets an attribute of any component type. Normalized integers reach the shader in [0, 1] or [-1, 1], other
/// integers as they are.
void attribute_numbers(unsigned location, int components, unsigned component_type, bool normalized,
                       const Buffer &buffer, int stride_bytes, std::size_t offset_bytes);

/// Returns the distance between blocks of so many bytes in a uniform buffer.
std::size_t aligned_uniform_bytes(std::size_t bytes);

} // namespace paradize::gl
