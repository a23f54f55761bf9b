// SendOutcome: counts what happened to one message for all receivers of an output. All outputs
// count as posed.v1.OutputStats describes. News: what an output has to tell.
#pragma once

#include <cstdint>
#include <string>

namespace posed::output {

// Each number counts receivers. The refusal of a datagram that the system had accepted is told with
// the next one: that is then counted as failed, so that the sum of all is right.
struct SendOutcome {
  std::uint64_t sent = 0;     // the system accepted it, and no refusal was told
  std::uint64_t dropped = 0;  // not sent because the receiver, or the network, is slow
  std::uint64_t failed = 0;   // the system refused it: nobody listens, no way there, hung up
};

struct News {
  std::string text{};  // one sentence
  bool good = false;   // what was wrong is over
};

}  // namespace posed::output
