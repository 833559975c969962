#pragma once
// A GLFW window with an OpenGL 3.3 core context, keyboard and mouse.

#include <memory>
#include <string>

namespace paradize {

/// Keyboard and mouse input since the last poll.
struct Input {
    bool close = false;                               // the close button was pressed
    bool any_key = false;                             // a key was pressed
    bool escape = false, pause = false, mute = false; // the key was pressed
    bool next_music = false;                          // the same
    int volume_steps = 0;
    // Keys that are held down, -1 to 1.
    float right = 0.0F, up = 0.0F, forward = 0.0F, roll = 0.0F;
    bool fast = false;
    double yaw_px = 0.0, pitch_px = 0.0; // mouse motion, to the right and downwards
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
    /// Creates the window and makes its context current. Throws Error if there is no display.
    explicit Window(const Settings &settings);
    ~Window();
    Window(const Window &) = delete;
    Window &operator=(const Window &) = delete;

    Input poll();
    /// Size of the framebuffer, at least 1 x 1.
    void size(int &width_px, int &height_px) const;
    bool minimised() const;
    /// Until something happens to the window, or a twentieth of a second has passed.
    void wait();
    void swap();
    void set_title(const std::string &title);
    /// Seconds since the window was created.
    double seconds() const;

  private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

} // namespace paradize
