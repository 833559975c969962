#pragma once

namespace paradize::assets {

/// Lowers the priority of the calling thread, so that reading and checking files take no time of a core from
/// the thread that draws, nor from those of a software rasteriser. On Linux alone; no effect where it is not
/// allowed.
void yield_to_drawing();

} // namespace paradize::assets
