#pragma once
// Finds uniforms that nothing has set. For --debug and tests: a program keeps the values of whoever used it
// last, so that a forgotten one is zero today and another scene's value tomorrow.

#include <string_view>

namespace paradize::gl {

/// From now on programs are linked with a mark in each uniform outside blocks, and a draw call throws Error
/// with the name of one that still holds it.
void check_uniforms();

/// Marks the uniforms of a program that was just linked. `file`: its fragment shader, for the message. Does
/// nothing without check_uniforms().
void mark_uniforms(unsigned program, std::string_view file);
/// Throws Error if a uniform of the program in use was never set. Once all are set, it is not looked at
/// again.
void find_marked_uniforms();

} // namespace paradize::gl
