// The page of `posed view` as commands open it: its folder, its bridge and the user's browser.
#pragma once

#include <filesystem>
#include <string>

#include "proto/frame/result.hpp"

namespace posed::tools {

// The folder with the page's files: `named` if it is not empty, else share/posed/viewer beside the
// installed program, else the one that this build makes. An Error if there is none, with the way to
// build it.
Result<std::filesystem::path> find_page(const std::filesystem::path& named);

// Opens the user's browser, if there are a screen and a terminal whose user sees that; does not
// wait for it. The list of processes shows the address, with its token, to other users of this
// machine.
void open_browser(const std::string& url);

}  // namespace posed::tools
