#include "gl/uniform_check.hpp"

#include "error.hpp"

#include <epoxy/gl.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

namespace paradize::gl {

namespace {

struct MarkedProgram {
    unsigned name = 0;
    std::string file;
};

bool checking = false; // all GL calls come from one thread
std::vector<MarkedProgram> marked;

constexpr std::size_t most_components = 16;

/// Components of a type of floats, 0 for samplers and integers.
int float_components(GLenum type) {
    switch (type) {
    case GL_FLOAT:
        return 1;
    case GL_FLOAT_VEC2:
        return 2;
    case GL_FLOAT_VEC3:
        return 3;
    case GL_FLOAT_VEC4:
        return 4;
    case GL_FLOAT_MAT3:
        return 9;
    case GL_FLOAT_MAT4:
        return 16;
    default:
        return 0;
    }
}

/// The texture unit that no pass uses, and the integer that none sets.
GLint integer_mark(GLenum type) {
    if (type == GL_INT) {
        return std::numeric_limits<GLint>::min();
    }
    GLint units = 0;
    glGetIntegerv(GL_MAX_COMBINED_TEXTURE_IMAGE_UNITS, &units);
    return units - 1;
}

void set_floats(GLint location, int components, const float *values) {
    switch (components) {
    case 1:
        return glUniform1fv(location, 1, values);
    case 2:
        return glUniform2fv(location, 1, values);
    case 3:
        return glUniform3fv(location, 1, values);
    case 4:
        return glUniform4fv(location, 1, values);
    case 9:
        return glUniformMatrix3fv(location, 1, GL_FALSE, values);
    default:
        return glUniformMatrix4fv(location, 1, GL_FALSE, values);
    }
}

bool holds_mark(unsigned program, GLint location, GLenum type) {
    if (const int components = float_components(type); components != 0) {
        std::array<float, most_components> values{};
        glGetUniformfv(program, location, values.data());
        return std::all_of(values.begin(), values.begin() + components,
                           [](float value) { return std::isnan(value); });
    }
    GLint value = 0;
    glGetUniformiv(program, location, &value);
    return value == integer_mark(type);
}

GLint count_in_blocks(unsigned program) {
    GLint blocks = 0;
    GLint total = 0;
    glGetProgramiv(program, GL_ACTIVE_UNIFORM_BLOCKS, &blocks);
    for (GLint i = 0; i < blocks; ++i) {
        GLint members = 0;
        glGetActiveUniformBlockiv(program, static_cast<GLuint>(i), GL_UNIFORM_BLOCK_ACTIVE_UNIFORMS,
                                  &members);
        total += members;
    }
    return total;
}

/// Calls take(name, location, type) for each uniform outside blocks, and for each entry of an array.
template <class Take>
void for_each_uniform(unsigned program, const Take &take) {
    GLint count = 0;
    glGetProgramiv(program, GL_ACTIVE_UNIFORMS, &count);
    // Mesa walks its list for each index, and its list begins with hundreds of members of blocks.
    GLint outside = count - count_in_blocks(program);
    for (GLint i = count - 1; i >= 0 && outside > 0; --i) {
        std::array<char, 256> text{};
        GLint entries = 0;
        GLenum type = 0;
        glGetActiveUniform(program, static_cast<GLuint>(i), text.size(), nullptr, &entries, &type,
                           text.data());
        const std::string name = text.data();
        const auto index = static_cast<GLuint>(i);
        GLint block = -1;
        glGetActiveUniformsiv(program, 1, &index, GL_UNIFORM_BLOCK_INDEX, &block);
        outside -= block < 0 ? 1 : 0;
        for (GLint entry = 0; entry < entries; ++entry) {
            const std::string one =
                entries == 1 ? name : name.substr(0, name.find('[')) + "[" + std::to_string(entry) + "]";
            if (const GLint location = glGetUniformLocation(program, one.c_str()); location >= 0) {
                take(one, location, type);
            }
        }
    }
}

} // namespace

void check_uniforms() {
    checking = true;
}

void mark_uniforms(unsigned program, std::string_view file) {
    if (!checking) {
        return;
    }
    std::erase_if(marked, [&](const MarkedProgram &one) { return one.name == program; });
    marked.push_back({program, std::string(file)});
    std::array<float, most_components> mark{};
    mark.fill(std::numeric_limits<float>::quiet_NaN());
    glUseProgram(program);
    for_each_uniform(program, [&](const std::string &, GLint location, GLenum type) {
        if (const int components = float_components(type); components != 0) {
            set_floats(location, components, mark.data());
        } else {
            glUniform1i(location, integer_mark(type));
        }
    });
}

void find_marked_uniforms() {
    if (marked.empty()) {
        return;
    }
    GLint used = 0;
    glGetIntegerv(GL_CURRENT_PROGRAM, &used);
    const auto program = static_cast<unsigned>(used);
    const auto found = std::ranges::find(marked, program, &MarkedProgram::name);
    if (found == marked.end()) {
        return;
    }
    for_each_uniform(program, [&](const std::string &name, GLint location, GLenum type) {
        if (holds_mark(program, location, type)) {
            throw Error("shader " + found->file + ": nothing has set its uniform " + name);
        }
    });
    marked.erase(found);
}

} // namespace paradize::gl
