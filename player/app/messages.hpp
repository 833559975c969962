#pragma once
// Everything that the player says to a person goes through say(), so that no byte of a file or of a name
// steers the terminal.

#include <string>
#include <string_view>

namespace paradize {

/// The text with `\x1B` for control characters (but not newlines and tabs) and for bytes that are no UTF-8,
/// and
/// `\u{202E}` for characters that are not seen: controls beyond ASCII, marks of direction, separators of
/// lines.
std::string printable(std::string_view text);

/// Writes `paradize-player: TEXT` to standard error, printable. Lines after the first are indented, so that a
/// newline in a name makes no message of its own.
void log_message(std::string_view text);

/// Writes all of the text to standard output, as it is. Throws Error where that is closed or full.
void print(const std::string &text);

} // namespace paradize
