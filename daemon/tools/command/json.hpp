// Messages as canonical proto3 JSON (lowerCamelCase names, 64-bit integers as text). Every plain
// field is written even if it has its default, so that a script always finds it.
#pragma once

#include <string>

namespace google::protobuf {
class Message;
}

namespace posed::tools {

[[nodiscard]] std::string to_json(const google::protobuf::Message& message);

// Prints one line on stdout and flushes it. Returns false if the reader of stdout has gone.
bool print_json(const google::protobuf::Message& message);

}  // namespace posed::tools
