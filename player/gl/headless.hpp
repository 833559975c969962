#pragma once
// An OpenGL 3.3 core context without a display, through EGL.

#include <memory>

namespace paradize::gl {

class HeadlessContext {
  public:
    /// Creates the context and makes it current. Throws Error if EGL offers none.
    explicit HeadlessContext(bool debug);
    ~HeadlessContext();
    HeadlessContext(const HeadlessContext &) = delete;
    HeadlessContext &operator=(const HeadlessContext &) = delete;

  private:
    void *display_ = nullptr;
    void *context_ = nullptr;
};

} // namespace paradize::gl
