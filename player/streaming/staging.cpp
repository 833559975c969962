#include "streaming/staging.hpp"

#include <utility>

namespace paradize {

void Staging::open(std::size_t bytes) {
    if (std::exchange(opened_, true)) {
        return;
    }
    mapped_ = gl::MappedBuffer::make(bytes);
    if (mapped_) {
        ring_.open(mapped_->memory);
    }
}

void Staging::close() {
    if (mapped_ && ring_.close()) {
        mapped_.reset();
    }
}

gl::Source Staging::source(const assets::StagedBytes &staged, std::size_t offset) const {
    if (staged.get_deleter().ring == nullptr) {
        return {staged.get() + offset};
    }
    const auto first = static_cast<std::size_t>(staged.get() - mapped_->memory.data());
    return {staged.get() + offset, mapped_->buffer.name(), first + offset};
}

void Staging::finish(assets::StagedBytes staged) {
    if (staged.get_deleter().ring != nullptr) {
        in_use_.add(std::move(staged));
    }
}

void Staging::end_frame() {
    if (in_use_.needs_fence()) {
        in_use_.put(gl::Fence::behind_all_commands());
    }
}

} // namespace paradize
