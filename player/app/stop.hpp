#pragma once
// SIGINT, SIGTERM and SIGHUP end the program between two frames, so that nothing half written is left.

namespace paradize {

/// From now on the first of these signals is noted, and the next one ends the program at once.
void note_stop_signals();
/// The signal that asked the program to stop; 0: none did.
int stop_signal();
/// Ends the program as the noted signal does by itself; returns where there was none.
void end_by_stop_signal();

} // namespace paradize
