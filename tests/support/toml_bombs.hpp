// TOML of some 62 KB that nests 15,000 to 62,000 deep, in every way that TOML can nest. toml++
// alone overflows its stack on the dotted ones.
#pragma once

#include <string>
#include <vector>

namespace posed::test {

// Each is one statement or one header, ended by a newline where a text may go on behind it.
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
      repeated("'' .") + "\"\" = 1\n",  // quoted keys, with blanks between
      "x = {" + dotted + " = 1}\n",
      "x = [1.5, {" + dotted + " = 1}]\n",
      "x = " + repeated("[") + "\n",
      "x = " + repeated("{a=") + "\n",
  };
}

}  // namespace posed::test
