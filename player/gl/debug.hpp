#pragma once
// Errors that the graphics driver reports (KHR_debug), and what the context is.

#include <cstdint>
#include <string>

namespace paradize::gl {

/// Collects errors of the current context. Must outlive all drawing in that context.
class DebugLog {
  public:
    DebugLog() = default;
    DebugLog(const DebugLog &) = delete;
    DebugLog &operator=(const DebugLog &) = delete;

    /// Installs a synchronous callback. Returns false if the context lacks KHR_debug; glGetError is used
    /// then.
    bool install();
    std::uint64_t errors() const { return errors_; }
    /// Throws Error with the first driver error since the last call, if there was one.
    void throw_on_error();

    void record(const char *message);

  private:
    std::uint64_t errors_ = 0;
    std::string first_;
};

/// Throws Error if an earlier GL call ran out of memory. Clears GL's error flag.
void check_memory();

/// GL_RENDERER and GL_VERSION of the current context.
std::string renderer_name();
std::string version_name();
/// True for CPU rasterisers: llvmpipe, softpipe, SwiftShader.
bool software_renderer();

} // namespace paradize::gl
