// Parses messages that come from somebody else. A part of two bytes on the wire (an empty message)
// takes hundreds in memory, so the parts are counted before memory is spent on them. Cold.
#pragma once

#include <cstddef>
#include <optional>
#include <span>

namespace google::protobuf {
class Message;
}

namespace posed::message {

// Parts that a message may have: messages, texts and fields that the schema does not know. The
// stats of 1,024 streams have 20,000.
inline constexpr std::size_t kMaxMessageParts = 32'768;

// The parts of a message of the same type as `type`. Empty for bytes that are no such message, and
// for those with too many parts.
[[nodiscard]] std::optional<std::size_t> count_parts(const google::protobuf::Message& type,
                                                     std::span<const std::byte> bytes);

// Returns false for bytes that are no such message, and for those with too many parts; `message` is
// then empty, or has what could be read.
[[nodiscard]] bool parse_bounded(google::protobuf::Message& message,
                                 std::span<const std::byte> bytes);

}  // namespace posed::message
