// The rules for every file that a command writes: its extension must not be that of another format,
// it must not be a file that the command reads, and an existing file is replaced only with
// --overwrite, also one that comes while the command works. Checked before any work is done.
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

namespace posed::tools {

// Adds `--overwrite`.
CLI::Option* add_overwrite_option(CLI::App& command, bool& overwrite);

// Adds `--report FILE.html`.
CLI::Option* add_report_option(CLI::App& command, std::string& path);

// The report of a command that writes nothing else: `--report` and `--overwrite`.
struct ReportFile {
  std::string path;  // empty: none
  bool overwrite = false;

  [[nodiscard]] bool wanted() const { return !path.empty(); }
  Result<> check() const;
};
void add_report_file(CLI::App& command, ReportFile& file);

class OutputFiles {
 public:
  explicit OutputFiles(bool overwrite) : overwrite_(overwrite) {}

  // Adds a file that the command reads; an empty path is ignored.
  OutputFiles& reads(const std::filesystem::path& path);
  template <typename Paths>
  OutputFiles& reads_all(const Paths& paths) {
    for (const auto& path : paths) reads(path);
    return *this;
  }

  // Adds a file that the command writes; an empty path is ignored. `extensions`: the possible
  // formats, such as {".bvh", ".csv"}; the name must end in one of them.
  OutputFiles& writes(const std::filesystem::path& path, std::vector<std::string_view> extensions);
  // The same for a format that is recognised by its contents: any extension except those of other
  // formats.
  OutputFiles& writes_any_but_other(const std::filesystem::path& path,
                                    std::vector<std::string_view> extensions);

  // Wrong use (exit code 2) if one of the files must not be written; names the file and what to do.
  Result<> check() const;

 private:
  struct Output {
    std::filesystem::path path;
    std::vector<std::string_view> extensions;
    bool strict;
  };
  Result<> check(const Output& output) const;

  bool overwrite_;
  std::vector<std::filesystem::path> inputs_;
  std::vector<Output> outputs_;
};

}  // namespace posed::tools
