// A skeleton in the wire format (proto/wire/posed/v1/posed.proto), both ways. Cold.
#pragma once

#include <memory>
#include <string>

#include "posed/v1/posed.pb.h"
#include "proto/frame/result.hpp"
#include "proto/frame/skeleton.hpp"

namespace posed::message {

[[nodiscard]] v1::Skeleton skeleton_message(const std::string& stream, const Skeleton& skeleton,
                                            double rate_hz);

// The skeleton of a message, which is untrusted: counts, parents, lengths and names are checked,
// and the error names what is wrong. A message does not say in which frame a joint's channels turn,
// nor its limits; but a hand that posed knows, with the same id, comes back complete. For
// any other skeleton the id differs from that in the message.
Result<std::shared_ptr<const Skeleton>> skeleton_from(const v1::Skeleton& message);

}  // namespace posed::message
