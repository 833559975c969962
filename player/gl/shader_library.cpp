#include "gl/shader_library.hpp"

#include "error.hpp"

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <sstream>

namespace paradize::gl {

namespace {

constexpr int deepest_include = 16;

std::string read_text(const std::filesystem::path &path) {
    std::ifstream in(path, std::ios::binary);
    std::ostringstream text;
    text << in.rdbuf();
    if (!in) {
        throw Error(path.string() + ": cannot read this shader; is $PARADIZE_SHADERS right?");
    }
    return text.str();
}

/// Returns the name in `#include "name"`, or an empty text if the line is not an include.
std::string include_name(std::string_view line, const std::string &place) {
    const std::size_t start = line.find_first_not_of(" \t");
    if (start == std::string_view::npos || !line.substr(start).starts_with("#include")) {
        return {};
    }
    const std::size_t open = line.find('"');
    const std::size_t close = line.rfind('"');
    if (open == std::string_view::npos || close <= open + 1) {
        throw Error(place + ": an include is written #include \"lib/name.glsl\"");
    }
    std::string name(line.substr(open + 1, close - open - 1));
    if (name.front() == '/' || name.find("..") != std::string::npos) {
        throw Error(place + ": \"" + name + "\" is outside the shader folder; give a path from its root");
    }
    return name;
}

void append(ShaderSource &out, const std::filesystem::path &root, const std::string &name, int depth) {
    if (depth > deepest_include) {
        throw Error(name + ": includes are nested deeper than " + std::to_string(deepest_include));
    }
    const std::size_t number = out.files.size();
    out.files.push_back(name);
    std::istringstream text(read_text(root / name));
    out.text += "#line 1 " + std::to_string(number) + "\n";
    std::string line;
    for (int at = 1; std::getline(text, line); ++at) {
        const std::string included = include_name(line, name + ":" + std::to_string(at));
        if (included.empty()) {
            out.text += line + "\n";
            continue;
        }
        if (std::find(out.files.begin(), out.files.end(), included) == out.files.end()) {
            append(out, root, included, depth + 1);
        }
        out.text += "#line " + std::to_string(at + 1) + " " + std::to_string(number) + "\n";
    }
}

} // namespace

ShaderLibrary::ShaderLibrary(std::filesystem::path root, Dialect dialect)
    : root_(std::move(root)), dialect_(dialect) {}

std::filesystem::path ShaderLibrary::find() {
    if (const char *set = std::getenv("PARADIZE_SHADERS"); set != nullptr && *set != '\0') {
        if (!std::filesystem::is_directory(set)) {
            throw Error(std::string("$PARADIZE_SHADERS is ") + set + ", which is not a folder");
        }
        return set;
    }
    std::error_code failure;
    const std::filesystem::path executable = std::filesystem::read_symlink("/proc/self/exe", failure);
    const std::filesystem::path home = executable.parent_path();
    for (const char *place : {"../../shaders", "../../../shaders", "../share/paradize/shaders"}) {
        const std::filesystem::path candidate = (home / place).lexically_normal();
        if (std::filesystem::is_directory(candidate, failure)) {
            return candidate;
        }
    }
    throw Error("no shaders folder at ../../shaders, ../../../shaders or ../share/paradize/shaders beside " +
                home.string() + "; set $PARADIZE_SHADERS to it");
}

ShaderSource ShaderLibrary::source(std::string_view file, std::span<const std::string_view> defines) const {
    ShaderSource out;
    if (dialect_ == Dialect::glsl330) {
        out.text = "#version 330 core\n";
    } else {
        // Without this, samplers in ES default to lowp, which errs by 1e-4 on Mesa.
        out.text =
            "#version 300 es\nprecision highp float;\nprecision highp int;\nprecision highp sampler2D;\n"
            "precision highp samplerCube;\nprecision highp sampler2DArray;\n"
            "precision highp sampler2DArrayShadow;\n";
    }
    for (const std::string_view define : defines) {
        out.text += "#define " + std::string(define) + "\n";
    }
    append(out, root_, std::string(file), 0);
    return out;
}

} // namespace paradize::gl
