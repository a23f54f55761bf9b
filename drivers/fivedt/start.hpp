// What is said to a 5DT glove before it is read: its model and hand are checked, its stream
// started.
#pragma once

#include <string>
#include <vector>

#include "drivers/fivedt/decoder.hpp"
#include "drivers/transport/connection.hpp"
#include "proto/frame/hand.hpp"

namespace posed::drivers::fivedt {

// Up to a few seconds; an error says what came instead, or that the glove is of the other hand.
// Returns what the user should look at all the same. Cold.
[[nodiscard]] Result<std::vector<std::string>> start(Connection& link, Side side,
                                                     const Settings& settings);

}  // namespace posed::drivers::fivedt
