// The human-readable text of the pipeline's events, for event/<stream>, for files and for the log
// output. Cold.
#pragma once

#include <string>

#include "daemon/pipeline/messages.hpp"
#include "daemon/publish/shed_tally.hpp"
#include "posed/v1/posed.pb.h"

namespace posed::publish {

// One sentence without a full stop; empty for a kind that gets its text elsewhere. Control
// characters are removed from names that came over the network.
[[nodiscard]] std::string sentence(const pipeline::StreamEvent& event);
[[nodiscard]] std::string sentence(const ShedTally::Sum& shed);

// "body 'Ann' of source optitrack": the device's own name for the body may hold anything.
[[nodiscard]] std::string body_words(const std::string& source, const std::string& body);

// "body 'Ann' of source optitrack has left after frame 120": the end of such a body's stream.
[[nodiscard]] std::string has_left(const std::string& source, const std::string& body,
                                   std::uint64_t last_frame);

[[nodiscard]] v1::Event event_message(const std::string& stream, v1::Event::Kind kind,
                                      std::int64_t time_ns, std::uint64_t sequence,
                                      const std::string& text);

}  // namespace posed::publish
