#include "gl/program.hpp"

#include "error.hpp"
#include "gl/frame_uniforms.hpp"
#include "gl/light_uniforms.hpp"
#include "gl/material_uniforms.hpp"
#include "gl/shader_library.hpp"
#include "gl/uniform_check.hpp"

#include <epoxy/gl.h>
#include <glm/gtc/type_ptr.hpp>
#include <glm/mat3x3.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include <array>
#include <cctype>
#include <vector>

namespace paradize::gl {

namespace {

/// Replaces source-string numbers in the driver's log by file names: "2:17(3)" (Mesa), "2(17)" (NVIDIA).
std::string with_file_names(const std::string &log, const std::vector<std::string> &files) {
    std::string out;
    bool line_start = true;
    for (std::size_t i = 0; i < log.size(); ++i) {
        const auto digit = [&](std::size_t at) {
            return at < log.size() && std::isdigit(static_cast<unsigned char>(log[at])) != 0;
        };
        if (line_start && digit(i)) {
            std::size_t end = i;
            std::size_t number = 0;
            while (digit(end) && end < i + 4) {
                number = number * 10 + static_cast<std::size_t>(log[end++] - '0');
            }
            if (end < log.size() && (log[end] == ':' || log[end] == '(') && number < files.size()) {
                out += files[number];
                i = end;
            }
        }
        out += log[i];
        line_start = log[i] == '\n';
    }
    return out;
}

ShaderName compile(const ShaderLibrary &library, std::string_view file, GLenum type,
                   std::span<const std::string_view> defines) {
    const ShaderSource source = library.source(file, defines);
    ShaderName shader(glCreateShader(type));
    const char *text = source.text.c_str();
    glShaderSource(shader.name(), 1, &text, nullptr);
    glCompileShader(shader.name());
    GLint good = GL_FALSE;
    glGetShaderiv(shader.name(), GL_COMPILE_STATUS, &good);
    if (good != GL_TRUE) {
        std::array<char, 4096> log{};
        glGetShaderInfoLog(shader.name(), log.size(), nullptr, log.data());
        throw Error("shader " + (library.root() / file).string() + " does not compile:\n" +
                    with_file_names(log.data(), source.files));
    }
    return shader;
}

struct Member {
    const char *name;
    std::size_t offset;
};

constexpr std::array<Member, 18> frame_members{{
    {"view_projection", offsetof(FrameUniforms, view_projection)},
    {"view", offsetof(FrameUniforms, view)},
    {"inverse_view_projection", offsetof(FrameUniforms, inverse_view_projection)},
    {"shadow_from_world", offsetof(FrameUniforms, shadow_from_world)},
    {"eye", offsetof(FrameUniforms, eye)},
    {"clip_plane", offsetof(FrameUniforms, clip_plane)},
    {"viewport", offsetof(FrameUniforms, viewport)},
    {"lens", offsetof(FrameUniforms, lens)},
    {"sun_direction", offsetof(FrameUniforms, sun_direction)},
    {"sun_radiance", offsetof(FrameUniforms, sun_radiance)},
    {"ambient", offsetof(FrameUniforms, ambient)},
    {"fog", offsetof(FrameUniforms, fog)},
    {"water", offsetof(FrameUniforms, water)},
    {"clock", offsetof(FrameUniforms, clock)},
    {"anchor", offsetof(FrameUniforms, anchor)},
    {"wind", offsetof(FrameUniforms, wind)},
    {"wind_phases", offsetof(FrameUniforms, wind_phases)},
    {"daylight", offsetof(FrameUniforms, daylight)},
}};

constexpr std::size_t first_map = offsetof(MaterialUniforms, has_map);
constexpr std::array<Member, 20> material_members{{
    {"MaterialUniforms.base_color", offsetof(MaterialUniforms, base_color)},
    {"MaterialUniforms.emission_color", offsetof(MaterialUniforms, emission_color)},
    {"MaterialUniforms.translucency", offsetof(MaterialUniforms, translucency)},
    {"MaterialUniforms.beat", offsetof(MaterialUniforms, beat)},
    {"MaterialUniforms.parallax", offsetof(MaterialUniforms, parallax)},
    {"MaterialUniforms.specular_smoothness", offsetof(MaterialUniforms, specular_smoothness)},
    {"MaterialUniforms.metalness", offsetof(MaterialUniforms, metalness)},
    {"MaterialUniforms.occlusion_strength", offsetof(MaterialUniforms, occlusion_strength)},
    {"MaterialUniforms.alpha_cutoff", offsetof(MaterialUniforms, alpha_cutoff)},
    {"MaterialUniforms.wind_reach", offsetof(MaterialUniforms, wind_reach)},
    {"MaterialUniforms.has_color", first_map},
    {"MaterialUniforms.has_normal", first_map + 4},
    {"MaterialUniforms.has_height", first_map + 8},
    {"MaterialUniforms.has_gloss", first_map + 12},
    {"MaterialUniforms.has_occlusion", first_map + 16},
    {"MaterialUniforms.has_emission", first_map + 20},
    {"MaterialUniforms.has_second_normal", first_map + 24},
    {"MaterialUniforms.has_second_gloss", first_map + 28},
    {"MaterialUniforms.has_second_occlusion", first_map + 32},
    {"MaterialUniforms.has_second_emission", first_map + 36},
}};

constexpr std::array<Member, 3> light_members{{
    {"light_sets[0].state", offsetof(LightUniforms, state)},
    {"light_sets[0].place[0]", offsetof(LightUniforms, place)},
    {"light_sets[0].color[0]", offsetof(LightUniforms, color)},
}};

struct Block {
    const char *name;
    unsigned binding;
    std::span<const Member> members;
    std::size_t bytes;           // of the struct
    const char *shader, *header; // where shaders and player declare it
    bool repeats = false;        // an array of the struct
};

const std::array<Block, 3> blocks{{
    {"FrameUniforms", frame_uniforms_binding, frame_members, sizeof(FrameUniforms), "lib/frame.glsl",
     "gl/frame_uniforms.hpp"},
    {"MaterialUniforms", material_uniforms_binding, material_members, sizeof(MaterialUniforms),
     "lib/material.glsl", "gl/material_uniforms.hpp"},
    {"LightUniforms", light_uniforms_binding, light_members, sizeof(LightUniforms), "lib/point_lights.glsl",
     "gl/light_uniforms.hpp", true},
}};

/// Checks that the shader's block has the same members and offsets as the struct, and binds it.
void bind_block(unsigned program, std::string_view file, const Block &block) {
    const unsigned at = glGetUniformBlockIndex(program, block.name);
    if (at == GL_INVALID_INDEX) {
        return;
    }
    const auto advice = [&] {
        return std::string("; make the block in ") + block.shader + " the same as " + block.header;
    };
    for (const Member &member : block.members) {
        unsigned index = GL_INVALID_INDEX;
        glGetUniformIndices(program, 1, &member.name, &index);
        GLint offset = -1;
        if (index != GL_INVALID_INDEX) {
            glGetActiveUniformsiv(program, 1, &index, GL_UNIFORM_OFFSET, &offset);
        }
        if (offset != static_cast<GLint>(member.offset)) {
            const std::string_view name = member.name;
            throw Error("shader " + std::string(file) + ": " + block.name + "." +
                        std::string(name.substr(name.find('.') + 1)) + " lies at byte " +
                        std::to_string(offset) + ", the player writes it at " +
                        std::to_string(member.offset) + advice());
        }
    }
    GLint members = 0;
    GLint bytes = 0;
    glGetActiveUniformBlockiv(program, at, GL_UNIFORM_BLOCK_ACTIVE_UNIFORMS, &members);
    glGetActiveUniformBlockiv(program, at, GL_UNIFORM_BLOCK_DATA_SIZE, &bytes);
    const std::size_t entries =
        block.repeats ? static_cast<std::size_t>(members) / block.members.size() : std::size_t{1};
    if (static_cast<std::size_t>(members) != entries * block.members.size() ||
        static_cast<std::size_t>(bytes) > entries * block.bytes) {
        throw Error("shader " + std::string(file) + ": " + block.name + " has " + std::to_string(members) +
                    " members in " + std::to_string(bytes) + " bytes, the player writes " +
                    std::to_string(block.members.size()) + " in " + std::to_string(block.bytes) + advice());
    }
    glUniformBlockBinding(program, at, block.binding);
}

ProgramName link(const ShaderLibrary &library, std::string_view vertex_file, std::string_view fragment_file,
                 std::span<const std::string_view> defines) {
    ProgramName program = ProgramName::create();
    const ShaderName vertex = compile(library, vertex_file, GL_VERTEX_SHADER, defines);
    const ShaderName fragment = compile(library, fragment_file, GL_FRAGMENT_SHADER, defines);
    const unsigned name = program.name();
    glAttachShader(name, vertex.name());
    glAttachShader(name, fragment.name());
    glLinkProgram(name);
    glDetachShader(name, vertex.name());
    glDetachShader(name, fragment.name());
    GLint good = GL_FALSE;
    glGetProgramiv(name, GL_LINK_STATUS, &good);
    if (good != GL_TRUE) {
        std::array<char, 4096> log{};
        glGetProgramInfoLog(name, log.size(), nullptr, log.data());
        throw Error("shaders " + std::string(vertex_file) + " and " + std::string(fragment_file) +
                    " do not link:\n" + log.data());
    }
    for (const Block &block : blocks) {
        bind_block(name, fragment_file, block);
    }
    mark_uniforms(name, fragment_file);
    return program;
}

} // namespace

Program::Program(const ShaderLibrary &library, std::string_view vertex_file, std::string_view fragment_file,
                 std::initializer_list<std::string_view> defines) {
    const std::span<const std::string_view> list(defines.begin(), defines.size());
    std::string key = std::string(vertex_file) + '\n' + std::string(fragment_file);
    for (const std::string_view define : list) {
        (key += '\n') += define;
    }
    std::weak_ptr<const ProgramName> &known = library.programs()[key];
    program_ = known.lock();
    if (!program_) {
        program_ = std::make_shared<const ProgramName>(link(library, vertex_file, fragment_file, list));
        known = program_;
    }
}

void Program::use() const {
    glUseProgram(name());
}

int Program::location(const char *name) const {
    return glGetUniformLocation(this->name(), name);
}

void Program::set_unit(const char *name, int unit) const {
    use();
    glUniform1i(location(name), unit);
}

void Program::set(int location, int value) {
    glUniform1i(location, value);
}
void Program::set(int location, float value) {
    glUniform1f(location, value);
}
void Program::set(int location, const glm::vec2 &value) {
    glUniform2fv(location, 1, glm::value_ptr(value));
}
void Program::set(int location, const glm::vec3 &value) {
    glUniform3fv(location, 1, glm::value_ptr(value));
}
void Program::set(int location, const glm::vec4 &value) {
    glUniform4fv(location, 1, glm::value_ptr(value));
}
void Program::set(int location, const glm::mat3 &value) {
    glUniformMatrix3fv(location, 1, GL_FALSE, glm::value_ptr(value));
}
void Program::set(int location, const glm::mat4 &value) {
    glUniformMatrix4fv(location, 1, GL_FALSE, glm::value_ptr(value));
}

} // namespace paradize::gl
