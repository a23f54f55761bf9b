// How long a USB serial adapter collects bytes before it sends them. Cold.
#pragma once

#include <filesystem>
#include <string>

namespace posed::drivers {

// Requests that bytes come at once from the open port `fd` with the node `node`: by low_latency,
// which an FTDI adapter obeys, or by its latency timer below `sys`, where this process may set it.
// Returns a sentence for the log about what it changed, or could not change; empty if the adapter
// has no such timer or had it right.
[[nodiscard]] std::string ask_for_low_latency(int fd, const std::string& node,
                                              const std::filesystem::path& sys = "/sys");

}  // namespace posed::drivers
