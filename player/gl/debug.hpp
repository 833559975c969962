#pragma once
// The driver's own complaints (KHR_debug).

#include <cstdint>
#include <string>

namespace paradize::gl {

/// Collects errors of the context that is current. Keep it alive as long as that context draws.
class DebugLog {
  public:
    DebugLog() = default;
    DebugLog(const DebugLog &) = delete;
    DebugLog &operator=(const DebugLog &) = delete;

    /// Installs a synchronous callback; false when the context has no KHR_debug (then glGetError is asked).
    bool install();
    std::uint64_t errors() const { return errors_; }
    /// Throws Error with the first complaint since the last call, when there was one.
    void throw_on_error();

    void record(const char *message);

  private:
    std::uint64_t errors_ = 0;
    std::string first_;
};

/// Throws Error when an earlier call found no memory. Clears the error flag.
void check_memory();

/// GL_RENDERER and GL_VERSION of the context that is current.
std::string renderer_name();
std::string version_name();
/// Is the renderer a program on the CPU (llvmpipe, softpipe, SwiftShader)?
bool software_renderer();

} // namespace paradize::gl
