// Runs another program and waits for it. Cold.
#pragma once

#include <string>
#include <vector>

#include "proto/frame/result.hpp"

namespace posed::picture {

// Runs `arguments`, of which the first is the program's name, found in PATH. Its input is empty and
// its output is discarded. `package`: of Debian, for the sentence that is returned if the program
// is not installed. Ctrl-C reaches the program too; then the error says that it was interrupted.
[[nodiscard]] Result<> run_program(const std::vector<std::string>& arguments,
                                   const std::string& package);

}  // namespace posed::picture
