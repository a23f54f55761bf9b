// Starts a 5DT glove before it is read: checks its model and hand, and starts its stream.
#pragma once

#include <string>
#include <vector>

#include "drivers/fivedt/decoder.hpp"
#include "drivers/transport/connection.hpp"
#include "proto/frame/hand.hpp"

namespace posed::drivers::fivedt {

// Takes up to a few seconds. An error states what came instead, or that the glove is of the other
// hand. Returns warnings for the user. Cold.
[[nodiscard]] Result<std::vector<std::string>> start(Connection& link, Side side,
                                                     const Settings& settings);

}  // namespace posed::drivers::fivedt
