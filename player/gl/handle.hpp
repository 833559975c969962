#pragma once
// Move-only names of GL objects. Zero is empty; a name is freed exactly once.

#include <utility>

namespace paradize::gl {

enum class Kind { buffer, texture, vertex_array, program, shader, framebuffer, renderbuffer, sampler };

/// Makes one name of a kind that GL generates by glGen*; programs and shaders are made by their own classes.
unsigned generate(Kind kind);
/// Frees a name; zero is ignored. Needs the context that made it to be current.
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
    /// Gives the name away; the caller frees it.
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

} // namespace paradize::gl
