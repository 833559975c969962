#include "gl/buffer.hpp"

#include <epoxy/gl.h>

namespace paradize::gl {

Buffer make_buffer(unsigned target, std::size_t bytes, Usage usage) {
    Buffer buffer = Buffer::create();
    glBindBuffer(target, buffer.name());
    glBufferData(target, static_cast<GLsizeiptr>(bytes), nullptr,
                 usage == Usage::fixed ? GL_STATIC_DRAW : GL_DYNAMIC_DRAW);
    return buffer;
}

void write_buffer(unsigned target, const Buffer &buffer, std::size_t offset,
                  std::span<const std::byte> data) {
    glBindBuffer(target, buffer.name());
    glBufferSubData(target, static_cast<GLintptr>(offset), static_cast<GLsizeiptr>(data.size()), data.data());
}

void write_buffer(unsigned target, const Buffer &buffer, std::size_t offset, const Source &from,
                  std::size_t bytes) {
    if (from.buffer == 0) {
        write_buffer(target, buffer, offset, {from.bytes, bytes});
        return;
    }
    glBindBuffer(GL_COPY_READ_BUFFER, from.buffer);
    glBindBuffer(target, buffer.name());
    glCopyBufferSubData(GL_COPY_READ_BUFFER, target, static_cast<GLintptr>(from.offset),
                        static_cast<GLintptr>(offset), static_cast<GLsizeiptr>(bytes));
}

void copy_buffer(const Buffer &from, std::size_t from_offset, const Buffer &to, std::size_t to_offset,
                 std::size_t bytes) {
    glBindBuffer(GL_COPY_READ_BUFFER, from.name());
    glBindBuffer(GL_COPY_WRITE_BUFFER, to.name());
    glCopyBufferSubData(GL_COPY_READ_BUFFER, GL_COPY_WRITE_BUFFER, static_cast<GLintptr>(from_offset),
                        static_cast<GLintptr>(to_offset), static_cast<GLsizeiptr>(bytes));
}

void replace_buffer(unsigned target, const Buffer &buffer, std::span<const std::byte> data) {
    glBindBuffer(target, buffer.name());
    glBufferData(target, static_cast<GLsizeiptr>(data.size()), data.data(), GL_STREAM_DRAW);
}

std::byte *map_new_content(unsigned target, const Buffer &buffer, std::size_t bytes) {
    glBindBuffer(target, buffer.name());
    glBufferData(target, static_cast<GLsizeiptr>(bytes), nullptr, GL_STREAM_DRAW);
    return static_cast<std::byte *>(
        glMapBufferRange(target, 0, static_cast<GLsizeiptr>(bytes), GL_MAP_WRITE_BIT));
}

bool unmap(unsigned target) {
    return glUnmapBuffer(target) == GL_TRUE;
}

void attribute_floats(unsigned location, int components, const Buffer &buffer, int stride_bytes,
                      std::size_t offset_bytes, unsigned divisor) {
    attribute_numbers(location, components, GL_FLOAT, false, buffer, stride_bytes, offset_bytes);
    glVertexAttribDivisor(location, divisor);
}

void attribute_numbers(unsigned location, int components, unsigned component_type, bool normalized,
                       const Buffer &buffer, int stride_bytes, std::size_t offset_bytes) {
    glBindBuffer(GL_ARRAY_BUFFER, buffer.name());
    glEnableVertexAttribArray(location);
    glVertexAttribPointer(location, components, component_type, normalized ? GL_TRUE : GL_FALSE, stride_bytes,
                          reinterpret_cast<const void *>(offset_bytes));
}

std::size_t aligned_uniform_bytes(std::size_t bytes) {
    GLint alignment = 1;
    glGetIntegerv(GL_UNIFORM_BUFFER_OFFSET_ALIGNMENT, &alignment);
    const auto step = static_cast<std::size_t>(alignment);
    return (bytes + step - 1) / step * step;
}

} // namespace paradize::gl
