#pragma once

namespace paradize::gl {

/// A software rasteriser takes textures and buffers from malloc, which gives large ones back to the system
/// when they are deleted. The next one then faults its pages in anew, which takes longer than filling them.
/// After this call malloc keeps up to 256 MiB for them. No effect on other devices, nor with another libc
/// than glibc.
void keep_deleted_memory();

} // namespace paradize::gl
