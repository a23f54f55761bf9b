// [PERSON:]FILE on the command line. The person is the part before the first colon where no file
// has the whole name and that part holds no '/', which only a file's name does. Cold.
#pragma once

#include <filesystem>
#include <string>
#include <system_error>

namespace posed::tools {

struct PersonClip {
  std::string person, file;  // person empty: not named
};

[[nodiscard]] inline PersonClip person_clip(const std::string& argument) {
  const auto colon = argument.find(':');
  std::error_code ignored;
  if (colon == std::string::npos || colon == 0 || std::filesystem::exists(argument, ignored)) {
    return {{}, argument};
  }
  std::string person = argument.substr(0, colon);
  if (person.contains('/')) return {{}, argument};
  return {std::move(person), argument.substr(colon + 1)};
}

}  // namespace posed::tools
