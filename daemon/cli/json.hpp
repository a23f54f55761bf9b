// Messages as canonical proto3 JSON (lowerCamelCase names, 64-bit integers as text), every plain
// field written even where it has its default, so that a script always finds it.
#pragma once

#include <string>

namespace google::protobuf {
class Message;
}

namespace posed::cli {

[[nodiscard]] std::string to_json(const google::protobuf::Message& message);

// One line on stdout, at once. False when nobody reads it any more.
bool print_json(const google::protobuf::Message& message);

}  // namespace posed::cli
