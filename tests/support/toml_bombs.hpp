// TOML texts of about 62 KB that nest 15,000 to 62,000 levels deep, one for each way in which TOML
// can nest. toml++ alone overflows its stack on those with dots.
#pragma once

#include <string>
#include <vector>

namespace posed::test {

// Each is one statement or one header, followed by a newline where more text may follow.
inline std::vector<std::string> toml_bombs() {
  constexpr std::size_t kBytes = 62'000;
  const auto repeated = [](const std::string& piece) {
    std::string all;
    while (all.size() < kBytes) all += piece;
    return all;
  };
  const std::string dotted = repeated("a.") + "a";
  return {
      dotted + " = 1\n",
      "[" + dotted + "]\n",
      "[[" + dotted + "]]\nb = 1\n",
      repeated("'' .") + "\"\" = 1\n",  // quoted keys separated by blanks
      "x = {" + dotted + " = 1}\n",
      "x = [1.5, {" + dotted + " = 1}]\n",
      "x = " + repeated("[") + "\n",
      "x = " + repeated("{a=") + "\n",
  };
}

}  // namespace posed::test
