#pragma once
// A GLFW window with an OpenGL 3.3 core context, its keys and its mouse.

#include <memory>
#include <string>

namespace paradize {

/// What the person did since the last poll.
struct Input {
    bool close = false;                               // the window's button
    bool any_key = false;                             // a key went down
    bool escape = false, pause = false, mute = false; // went down
    int volume_steps = 0;
    // held, -1 to 1
    float right = 0.0F, up = 0.0F, forward = 0.0F, roll = 0.0F;
    bool fast = false;
    double yaw_px = 0.0, pitch_px = 0.0; // mouse, right and down
};

class Window {
  public:
    struct Settings {
        std::string title;
        int width_px = 0, height_px = 0;
        bool visible = true;
        bool capture_mouse = false;
        bool debug = false;
    };
    /// Makes the window and its context current. Throws Error when there is no display.
    explicit Window(const Settings &settings);
    ~Window();
    Window(const Window &) = delete;
    Window &operator=(const Window &) = delete;

    Input poll();
    /// Of the framebuffer, at least 1 x 1.
    void size(int &width_px, int &height_px) const;
    bool minimised() const;
    void swap();
    /// Seconds since the window was made.
    double seconds() const;

  private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

} // namespace paradize
