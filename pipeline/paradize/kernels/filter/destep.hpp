// Heights that a source rounded to steps, made smooth again without leaving what the rounding allows.
//
// Of all surfaces within half a step of the source, the one that bends least is sought: the sum of squared
// second differences along x and y, each weighted by how gently the source bends there, is lowered by
// projected gradient steps with momentum (Y. Nesterov, "A method of solving a convex programming problem with
// convergence rate O(1/k^2)", 1983), from the coarsest level of a pyramid to the finest (F. A. Bornemann and
// P. Deuflhard, "The cascadic multigrid method", 1996). Where the source bends by more than about half a step
// per texel it says enough by itself: there the weight goes to zero and its values stay, so edges neither
// ring nor flatten.
#pragma once

#include <cstddef>
#include <span>

namespace paradize::filter {

// heights, out: rows * columns; heights finite. step > 0: the distance of neighbouring source values. Every
// out[i] is within step / 2 of heights[i], exactly. wrap: whether the map repeats. A constant and, but for
// its ends, a linear ramp that meets its steps come out as they are and as a line. The result does not depend
// on `threads`.
void destep(std::span<const float> heights, std::size_t rows, std::size_t columns, double step, bool wrap_x,
            bool wrap_y, std::span<float> out, int threads);

} // namespace paradize::filter
