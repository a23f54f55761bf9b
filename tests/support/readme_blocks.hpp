// The code blocks of the READMEs, for tests that try them.
#pragma once

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "tests/support/shared.hpp"

namespace posed::test {

struct ReadmeBlock {
  std::string file;      // below the source folder
  int line = 0;          // of its first line of code
  std::string language;  // behind the opening ```; may be empty
  std::string text;
};

// All pages in Markdown of the source tree, by name.
inline std::vector<std::filesystem::path> readme_files() {
  constexpr std::array<const char*, 4> kOther{"build", "node_modules", ".git", ".cache"};
  std::vector<std::filesystem::path> files;
  std::filesystem::recursive_directory_iterator entry(source_dir());
  for (; entry != std::filesystem::recursive_directory_iterator(); ++entry) {
    const std::string name = entry->path().filename().string();
    if (entry->is_directory() && std::ranges::find(kOther, name) != kOther.end()) {
      entry.disable_recursion_pending();
    }
    if (entry->path().extension() == ".md") files.push_back(entry->path());
  }
  std::ranges::sort(files);
  return files;
}

inline std::vector<ReadmeBlock> readme_blocks() {
  std::vector<ReadmeBlock> blocks;
  for (const auto& path : readme_files()) {
    std::ifstream file(path);
    const std::string name = path.lexically_relative(source_dir()).string();
    bool inside = false;
    int number = 0;
    for (std::string line; std::getline(file, line);) {
      ++number;
      const bool fence = line.starts_with("```");
      if (fence && !inside) blocks.push_back({name, number + 1, line.substr(3), ""});
      if (fence) inside = !inside;
      if (!fence && inside) blocks.back().text += line + "\n";
    }
  }
  return blocks;
}

}  // namespace posed::test
