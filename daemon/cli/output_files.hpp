// The one rule for every file that a command writes: its extension must not promise another format,
// it is never a file that the command reads, and a file that exists is replaced only by
// --overwrite. Asked before any work is done.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "proto/frame/result.hpp"

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace posed::cli {

// Whether the file's name says that it is an AMC, which needs a skeleton (.asf).
[[nodiscard]] bool is_amc(const std::filesystem::path& path);

// Adds `--overwrite`.
CLI::Option* add_overwrite_option(CLI::App& command, bool& overwrite);

class OutputFiles {
 public:
  explicit OutputFiles(bool overwrite) : overwrite_(overwrite) {}

  // A file that the command reads; an empty path is none.
  OutputFiles& reads(const std::filesystem::path& path);
  template <typename Paths>
  OutputFiles& reads_all(const Paths& paths) {
    for (const auto& path : paths) reads(path);
    return *this;
  }

  // A file that the command writes; an empty path is none. `extensions`: the formats it can be,
  // such as {".bvh", ".csv"}; it must end in one of them.
  OutputFiles& writes(const std::filesystem::path& path, std::vector<std::string_view> extensions);
  // The same for a format that is known by its contents: any extension but another format's.
  OutputFiles& writes_any_but_other(const std::filesystem::path& path,
                                    std::vector<std::string_view> extensions);

  // Wrong use (exit code 2) that names the file and what to do, when one of them must not be
  // written.
  [[nodiscard]] Result<> check() const;

 private:
  struct Output {
    std::filesystem::path path;
    std::vector<std::string_view> extensions;
    bool strict;
  };
  [[nodiscard]] Result<> check(const Output& output) const;

  bool overwrite_;
  std::vector<std::filesystem::path> inputs_;
  std::vector<Output> outputs_;
};

}  // namespace posed::cli
