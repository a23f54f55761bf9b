// Device nodes: opens one, explains in one sentence why it cannot be opened, and asks the USB
// adapter of a serial port for low latency. Cold.
#pragma once

#include <filesystem>
#include <string>

#include "proto/frame/result.hpp"

namespace posed::drivers {

// Opens the node for reading and writing, non-blocking, not inherited, locked against a second
// posed. The caller closes it. Cold.
Result<int> open_node(const std::string& path);

// Why a node could not be opened, and how to fix it. Cold.
[[nodiscard]] std::string node_open_error(const std::string& path, int error);

// Requests that bytes come at once from the open port `fd` with the node `node`: by low_latency,
// which an FTDI adapter obeys, or by its latency timer below `sys`, where this process may set it.
// Returns a sentence for the log about what it changed, or could not change; empty if the adapter
// has no such timer or had it right.
[[nodiscard]] std::string ask_for_low_latency(int fd, const std::string& node,
                                              const std::filesystem::path& sys = "/sys");

}  // namespace posed::drivers
