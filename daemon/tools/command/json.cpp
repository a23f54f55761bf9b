#include "daemon/tools/command/json.hpp"

#include <cstdio>

#include <google/protobuf/util/json_util.h>

namespace posed::tools {

std::string to_json(const google::protobuf::Message& message) {
  google::protobuf::util::JsonPrintOptions options;
  options.always_print_primitive_fields = true;
  std::string text;
  if (!google::protobuf::util::MessageToJsonString(message, &text, options).ok()) return "{}";
  return text;
}

bool print_json(const google::protobuf::Message& message) {
  const std::string line = to_json(message) + "\n";
  return std::fwrite(line.data(), 1, line.size(), stdout) == line.size() &&
         std::fflush(stdout) == 0;
}

}  // namespace posed::tools
