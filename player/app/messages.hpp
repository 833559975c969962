#pragma once
// All messages for the user pass through log_message(), so that bytes of a file or a name cannot control the
// terminal.

#include <cstddef>
#include <string>
#include <string_view>

namespace paradize {

/// Escapes control characters (except newline and tab) and invalid UTF-8 as `\x1B`, and invisible characters
/// (controls above ASCII, direction marks, line separators) as `\u{202E}`.
std::string printable(std::string_view text);

/// Writes `paradize-player: TEXT` to standard error, with unprintable characters escaped. Further lines are
/// indented, so that a newline in a name cannot fake a message.
void log_message(std::string_view text);

/// Writes `paradize-player: 57 of 300 frames drawn, 1:20 left` to standard error. Allocates nothing.
void log_progress(std::size_t drawn, std::size_t frames, double left_s);

/// Writes the text unchanged to standard output. Throws Error if standard output is closed or the disk is
/// full.
void print(const std::string &text);

} // namespace paradize
