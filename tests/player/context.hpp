#pragma once
// One headless context for all GL tests.

namespace paradize::test {

/// Makes the context current on the first call; false, with a message of doctest, where there is no EGL
/// driver.
bool have_context();
/// Fails the test when the driver complained since the last call.
void throw_on_error();
/// Forgets complaints, as of a shader that a test breaks.
void forget();

} // namespace paradize::test
