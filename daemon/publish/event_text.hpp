// What the pipeline's events say to people, on event/<stream> and in the log output. Cold.
#pragma once

#include <string>

#include "daemon/pipeline/messages.hpp"
#include "daemon/publish/shed_tally.hpp"

namespace posed::publish {

// One sentence without a full stop; empty for a kind that is told otherwise. Names that came over
// the network are cleaned.
[[nodiscard]] std::string sentence(const pipeline::StreamEvent& event);
[[nodiscard]] std::string sentence(const ShedTally::Sum& shed);

}  // namespace posed::publish
