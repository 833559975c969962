#pragma once
// The mesh of the sea: a grid around the eye that reaches the horizon.

#include "gl/handle.hpp"
#include "scene/view.hpp"

#include <glm/vec2.hpp>

#include <vector>

namespace paradize {

class SeaGrid {
  public:
    /// reach_m: how far it extends to each side.
    static SeaGrid flat(float reach_m);
    /// Fine enough for waves near the eye, the longest of this length.
    static SeaGrid with_waves(float wave_length_m, float reach_m);

    /// Draws the cells that the view sees, with the program in use. `center`: of the grid, in the view's
    /// coordinates. The sea ends at `half_size_m` from the world's origin. `rise_m`: how far waves move it
    /// from its level. Allocates nothing.
    void draw(const View &view, const glm::vec2 &center, float half_size_m, float level_m, float rise_m);

  private:
    explicit SeaGrid(std::vector<float> lines);

    std::vector<float> lines_; // x of the columns and z of the rows, from the center, ascending
    gl::VertexArray vertex_array_;
    gl::Buffer vertices_, indices_;
    // Arguments of glMultiDrawElementsBaseVertex, one run of cells of a row each.
    std::vector<int> counts_, base_vertices_;
    std::vector<const void *> offsets_;
};

} // namespace paradize
