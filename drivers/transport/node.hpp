// Device nodes: opening one, and saying in a sentence why it does not open.
#pragma once

#include <string>

#include "proto/frame/result.hpp"

namespace posed::drivers {

// The node opened for reading and writing, non-blocking, not inherited, locked against a second
// posed. The caller closes it. Cold.
[[nodiscard]] Result<int> open_node(const std::string& path);

// Why a node did not open and what mends it. Cold.
[[nodiscard]] std::string node_trouble(const std::string& path, int error);

}  // namespace posed::drivers
