// SendOutcome: counts what happened to one message for all receivers of an output. All outputs
// count as posed.v1.OutputStats describes.
#pragma once

#include <cstdint>

namespace posed::output {

// Each number counts receivers, except that a receiver whose refusal is followed by a send that
// works is counted in both.
struct SendOutcome {
  std::uint64_t sent = 0;     // the system accepted it
  std::uint64_t dropped = 0;  // not sent because the receiver, or the network, is slow
  std::uint64_t failed = 0;   // the system refused it: nobody listens, no way there, hung up
};

}  // namespace posed::output
