#pragma once
// Finds shader files, resolves their includes and adds the preamble.

#include "gl/handle.hpp"

#include <filesystem>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace paradize::gl {

enum class Dialect { glsl330, es300 };

/// Source text for GL. `files[n]` is the file with source-string number n in GL's messages.
struct ShaderSource {
    std::string text;
    std::vector<std::string> files;
};

/// The folder shaders/. A file holds a shader body without #version. `#include "lib/x.glsl"` is resolved from
/// the folder's root, each file once. Messages name the original files.
class ShaderLibrary {
  public:
    explicit ShaderLibrary(std::filesystem::path root, Dialect dialect = Dialect::glsl330);

    /// Returns $PARADIZE_SHADERS, or a folder beside the executable: ../../shaders, ../../../shaders (build
    /// folders) or ../share/paradize/shaders (installed). Throws Error with these paths if there is none.
    static std::filesystem::path find();

    /// Returns the preamble and the body. The preamble holds #version, the precisions for ES 300 and one
    /// `#define` per entry ("NAME" or "NAME VALUE"). Throws Error if a file is missing or an include is
    /// malformed or outside the folder.
    ShaderSource source(std::string_view file, std::span<const std::string_view> defines = {}) const;
    const std::filesystem::path &root() const { return root_; }
    /// Programs that exist, by files and defines. Program uses it to share them.
    std::map<std::string, std::weak_ptr<const ProgramName>> &programs() const { return programs_; }

  private:
    std::filesystem::path root_;
    Dialect dialect_;
    mutable std::map<std::string, std::weak_ptr<const ProgramName>> programs_;
};

} // namespace paradize::gl
