// Device nodes: opens one, and explains in one sentence why it cannot be opened.
#pragma once

#include <string>

#include "proto/frame/result.hpp"

namespace posed::drivers {

// Opens the node for reading and writing, non-blocking, not inherited, locked against a second
// posed. The caller closes it. Cold.
[[nodiscard]] Result<int> open_node(const std::string& path);

// Why a node could not be opened, and how to fix it. Cold.
[[nodiscard]] std::string node_open_error(const std::string& path, int error);

}  // namespace posed::drivers
