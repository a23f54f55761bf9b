// SendOutcome: counts what happened to one message for all receivers of an output. All outputs
// count as posed.v1.OutputStats describes. News: a sentence of an output for users.
#pragma once

#include <cstdint>
#include <string>

namespace posed::output {

// Each number counts receivers. The system may accept a datagram and report its refusal only with
// the next one: then that one counts as failed, so that the sums are right.
struct SendOutcome {
  std::uint64_t sent = 0;     // the system accepted it, and reported no refusal
  std::uint64_t dropped = 0;  // not sent because the receiver, or the network, is slow
  std::uint64_t failed = 0;   // the system refused it: nobody listens, no way there, hung up
};

struct News {
  std::string text{};  // one sentence
  bool good = false;   // what was wrong is over
};

}  // namespace posed::output
