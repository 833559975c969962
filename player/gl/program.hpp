#pragma once
// A linked shader program and its uniforms.

#include "gl/handle.hpp"

#include <glm/fwd.hpp>

#include <initializer_list>
#include <memory>
#include <string>
#include <string_view>

namespace paradize::gl {

class ShaderLibrary;

/// Binding points of the uniform blocks FrameUniforms, MaterialUniforms and LightUniforms.
inline constexpr unsigned frame_uniforms_binding = 0;
inline constexpr unsigned material_uniforms_binding = 1;
inline constexpr unsigned light_uniforms_binding = 2;

class Program {
  public:
    Program() noexcept = default;
    /// Loads, compiles and links. If a program of the same files and defines exists, shares that one and its
    /// uniform values. Binds the blocks of uniforms that the program uses, and checks their members. Throws
    /// Error with file, line and the driver's message.
    Program(const ShaderLibrary &library, std::string_view vertex_file, std::string_view fragment_file,
            std::initializer_list<std::string_view> defines = {});

    void use() const;
    /// Returns -1 if the program has no such active uniform; set() ignores -1. Look locations up once, in a
    /// constructor.
    int location(const char *name) const;
    /// Assigns a texture unit to a sampler uniform. Call it once, in a constructor. Makes the program
    /// current.
    void set_unit(const char *name, int unit) const;

    // These set uniforms of the program in use.
    static void set(int location, int value);
    static void set(int location, float value);
    static void set(int location, const glm::vec2 &value);
    static void set(int location, const glm::vec3 &value);
    static void set(int location, const glm::vec4 &value);
    static void set(int location, const glm::mat3 &value);
    static void set(int location, const glm::mat4 &value);

    unsigned name() const noexcept { return program_ ? program_->name() : 0; }
    explicit operator bool() const noexcept { return static_cast<bool>(program_); }

  private:
    std::shared_ptr<const ProgramName> program_;
};

} // namespace paradize::gl
