#pragma once
// Move-only owners of GL object names. Name 0 is empty. Each name is deleted exactly once.

#include <utility>

namespace paradize::gl {

enum class Kind { buffer, texture, vertex_array, program, shader, framebuffer, renderbuffer, sampler, query };

/// Creates one object name with the glGen function of its kind. Shaders are created by Program.
unsigned generate(Kind kind);
/// Deletes a name and ignores 0. The context that created it must be current.
void destroy(Kind kind, unsigned name) noexcept;

template <Kind kind>
class Handle {
  public:
    Handle() noexcept = default;
    explicit Handle(unsigned name) noexcept : name_(name) {}
    Handle(Handle &&other) noexcept : name_(std::exchange(other.name_, 0U)) {}
    Handle &operator=(Handle &&other) noexcept {
        if (this != &other) {
            destroy(kind, name_);
            name_ = std::exchange(other.name_, 0U);
        }
        return *this;
    }
    Handle(const Handle &) = delete;
    Handle &operator=(const Handle &) = delete;
    ~Handle() { destroy(kind, name_); }

    static Handle create() { return Handle(generate(kind)); }

    unsigned name() const noexcept { return name_; }
    explicit operator bool() const noexcept { return name_ != 0; }
    /// Returns the name and gives up ownership. The caller deletes it.
    unsigned release() noexcept { return std::exchange(name_, 0U); }

  private:
    unsigned name_ = 0;
};

using Buffer = Handle<Kind::buffer>;
using Texture = Handle<Kind::texture>;
using VertexArray = Handle<Kind::vertex_array>;
using ProgramName = Handle<Kind::program>;
using ShaderName = Handle<Kind::shader>;
using Framebuffer = Handle<Kind::framebuffer>;
using Renderbuffer = Handle<Kind::renderbuffer>;
using Sampler = Handle<Kind::sampler>;
using Query = Handle<Kind::query>;

} // namespace paradize::gl
