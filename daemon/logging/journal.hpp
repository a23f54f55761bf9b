// The journal of systemd: lines of the log with fields, so that `journalctl POSED_STREAM=walker`
// shows those of one stream. Cold.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace posed::logging {

// Whether what is written to the descriptor goes into the journal: systemd gives its device and
// inode to a service in JOURNAL_STREAM.
[[nodiscard]] bool is_journal(int descriptor);

// The fields of a line of `level` (spdlog's), each "NAME=value": MESSAGE, PRIORITY, the line
// without its numbers (POSED_CAUSE), how many lines it stands for (POSED_COUNT), and the word
// before its first colon, which names the stream where a line is about one (POSED_STREAM). `cause`
// is what cause_of() returns for the line, or for those that it sums up. The text has no line end
// and no control character.
[[nodiscard]] std::vector<std::string> journal_fields(int level, std::string_view text,
                                                      std::string_view cause, std::uint64_t count);

// Returns false if the journal does not take the fields.
[[nodiscard]] bool send_to_journal(const std::vector<std::string>& fields);

}  // namespace posed::logging
