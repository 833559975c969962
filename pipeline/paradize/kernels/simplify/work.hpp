// The state that all steps of one simplification share.
#pragma once

#include <cstdint>
#include <vector>

#include "simplify/choice.hpp"
#include "simplify/collapse.hpp"
#include "simplify/cost.hpp"
#include "simplify/mesh.hpp"
#include "simplify/queue.hpp"

namespace paradize::simplify {

using Numbers = std::vector<std::uint32_t>;

enum State : std::uint8_t { queued, parked, dead };

struct Work {
    const Input &input;
    const Limits &limits;
    Surface surface;
    Quadrics quadrics;
    Queue queue = {};
    std::vector<std::uint8_t> state = {}; // (edges)
    Numbers seen = {};                    // (vertices) the last mark each got
    std::uint32_t mark = 0;
    std::size_t left = 0; // triangles
    std::vector<double> component_area = {};
    std::vector<double> component_least_area = {};
    // Of the edge in hand: half-edges that leave both ends.
    Numbers ring_p = {};
    Numbers ring_q = {};
    Numbers done = {}; // wedges that were met
};

// Whether the edge of half-edge h, both its rings collected, may collapse to `at`: the surface stays of one
// kind, no triangle turns over or becomes a line, a locked vertex keeps its wedges, and a component its area,
// which is brought up to date.
bool allowed(Work &work, std::uint32_t h, Vec at);

// Collapses it. Edges put aside around it come back into `bucket`.
void collapse(Work &work, std::uint32_t h, Vec at, std::uint32_t bucket);

void write(const Work &work, Result &result);

} // namespace paradize::simplify
