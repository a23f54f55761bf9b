// The human-readable text of the pipeline's events, for event/<stream> and for the log output.
// Cold.
#pragma once

#include <string>

#include "daemon/pipeline/messages.hpp"
#include "daemon/publish/shed_tally.hpp"

namespace posed::publish {

// One sentence without a full stop; empty for a kind that gets its text elsewhere. Control
// characters are removed from names that came over the network.
[[nodiscard]] std::string sentence(const pipeline::StreamEvent& event);
[[nodiscard]] std::string sentence(const ShedTally::Sum& shed);

// "body 'Ann' of source optitrack": the device's own name for the body may hold anything.
[[nodiscard]] std::string body_words(const std::string& source, const std::string& body);

}  // namespace posed::publish
