#pragma once
// The headless context that all GL tests share.

namespace paradize::test {

/// Makes the context current. Creates it on the first call. Without an EGL driver it returns false and
/// doctest prints a message.
bool have_context();
/// Fails the test if the driver has reported an error since the last call.
void throw_on_error();
/// Clears recorded errors, after a test has caused them on purpose.
void clear_errors();
/// A number above the names of all GL objects. Drivers count up, or take the lowest name that is free.
unsigned names_end();

} // namespace paradize::test
