// How a sentence for the user names a thing of theirs: 'index_mcp'.
#pragma once

#include <string>
#include <string_view>

namespace posed {

[[nodiscard]] inline std::string in_quotes(std::string_view name) {
  return "'" + std::string(name) + "'";
}

}  // namespace posed
