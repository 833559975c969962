#include "gl/mapped_buffer.hpp"

#include <epoxy/gl.h>

namespace paradize::gl {

std::optional<MappedBuffer> MappedBuffer::make(std::size_t bytes) {
    if (!epoxy_has_gl_extension("GL_ARB_buffer_storage") && epoxy_gl_version() < 44) {
        return std::nullopt;
    }
    MappedBuffer out{Buffer::create(), {}};
    const auto size = static_cast<GLsizeiptr>(bytes);
    // Inflating and checks read the memory: without GL_MAP_READ_BIT its reads may bypass the caches.
    const GLbitfield access =
        GL_MAP_READ_BIT | GL_MAP_WRITE_BIT | GL_MAP_PERSISTENT_BIT | GL_MAP_COHERENT_BIT;
    glBindBuffer(GL_COPY_READ_BUFFER, out.buffer.name());
    glBufferStorage(GL_COPY_READ_BUFFER, size, nullptr, access | GL_CLIENT_STORAGE_BIT);
    auto *const mapped = static_cast<std::byte *>(glMapBufferRange(GL_COPY_READ_BUFFER, 0, size, access));
    if (mapped == nullptr) {
        return std::nullopt;
    }
    out.memory = {mapped, bytes};
    return out;
}

Fence Fence::behind_all_commands() {
    return Fence(glFenceSync(GL_SYNC_GPU_COMMANDS_COMPLETE, 0));
}

Fence::~Fence() {
    glDeleteSync(static_cast<GLsync>(sync_)); // ignores nullptr
}

bool Fence::passed() const {
    const GLenum found = glClientWaitSync(static_cast<GLsync>(sync_), GL_SYNC_FLUSH_COMMANDS_BIT, 0);
    return found == GL_ALREADY_SIGNALED || found == GL_CONDITION_SATISFIED;
}

} // namespace paradize::gl
