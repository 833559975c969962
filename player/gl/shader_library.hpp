#pragma once
// Where shader files are and how one becomes a source that GL takes.

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

/// What GL compiles; `files[n]` is the file whose source-string number in GL's messages is n.
struct ShaderSource {
    std::string text;
    std::vector<std::string> files;
};

/// The shaders/ folder. A file holds a body without #version; `#include "lib/x.glsl"` (from the folder's
/// root, each file once) is resolved here; names in messages stay those of the files.
class ShaderLibrary {
  public:
    explicit ShaderLibrary(std::filesystem::path root, Dialect dialect = Dialect::glsl330);

    /// $PARADIZE_SHADERS, else beside the executable: ../../shaders, ../../../shaders (build folders) or
    /// ../share/paradize/shaders (installed). Throws Error naming the places when there is none.
    static std::filesystem::path find();

    /// Preamble (#version, precisions of ES 300, one `#define` per entry, "NAME" or "NAME VALUE") and the
    /// body.
    /// Throws Error when a file is missing, an include is malformed or leaves the folder.
    ShaderSource source(std::string_view file, std::span<const std::string_view> defines = {}) const;
    const std::filesystem::path &root() const { return root_; }
    /// The programs that are in use, by files and defines: what Program finds and keeps.
    std::map<std::string, std::weak_ptr<const ProgramName>> &programs() const { return programs_; }

  private:
    std::filesystem::path root_;
    Dialect dialect_;
    mutable std::map<std::string, std::weak_ptr<const ProgramName>> programs_;
};

} // namespace paradize::gl
