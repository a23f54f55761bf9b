// The source tree for the tidy test: files as lines of text, also with comments and strings blanked
// out.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace posed::tidy {

struct SourceFile {
  std::string path;                // relative to the source directory, with '/'
  std::vector<std::string> lines;  // as written
  std::vector<std::string> code;   // comments and literals replaced by blanks
};

struct Finding {
  std::string path;
  int line = 0;
  std::string what;
};

// Every .hpp and .cpp of the modules (proto, models, drivers, daemon, tests).
[[nodiscard]] std::vector<SourceFile> read_source_tree(const std::filesystem::path& root);
[[nodiscard]] SourceFile source_from_text(std::string path, const std::string& text);

// Modules may include only what the dependency rules allow.
[[nodiscard]] std::vector<Finding> check_includes(const SourceFile& file);
// A target of the modules' CMakeLists.txt: posed_module(name FOLDERS folder... LINK target...).
struct Target {
  std::string name;
  std::vector<std::string> folders, links;
};
[[nodiscard]] bool has_folder(const Target& target, const std::string& folder);
[[nodiscard]] std::vector<Target> read_targets(const std::filesystem::path& root);
[[nodiscard]] std::vector<Target> targets_from_text(const std::string& text,
                                                    const std::string& command = "posed_module");
// The same for posed_test(...) of tests/CMakeLists.txt.
[[nodiscard]] std::vector<Target> read_test_programs(const std::filesystem::path& root);
// The targets form no cycle, and a file of a target's folder includes only folders of that target
// and of those that it links, directly or through others: linking is the permission.
[[nodiscard]] std::vector<Finding> check_cycles(const std::vector<Target>& targets);
[[nodiscard]] std::vector<Finding> check_links(const SourceFile& file,
                                               const std::vector<Target>& targets);
// Builds join the files of a target, in batches that change when a file is added. So two files of a
// target have no name twice in their anonymous namespaces, but for overloads and equal aliases.
[[nodiscard]] std::vector<Finding> check_joined_names(const std::vector<SourceFile>& files,
                                                      const std::vector<Target>& targets);
// A TEST_CASE, the folder of its file, and its tags as they are written.
struct TestCase {
  std::string folder, name, tags;
};
[[nodiscard]] std::vector<TestCase> tests_of(const SourceFile& file);
// Where a page says `program "filter"` of a program of tests, the filter names a test of it.
[[nodiscard]] std::vector<Finding> check_test_commands(const std::string& path,
                                                       const std::string& text,
                                                       const std::vector<TestCase>& tests,
                                                       const std::vector<Target>& programs);
// A reader of the repository has only the repository: no file names a page outside of it. `text` is
// any file's.
[[nodiscard]] std::vector<Finding> check_references(const std::string& path,
                                                    const std::string& text);
// A README begins with a title. A formatter for code that ran over one has broken it.
[[nodiscard]] std::vector<Finding> check_title(const std::string& path, const std::string& text);
// At most 100 columns a line, no left-over marks.
[[nodiscard]] std::vector<Finding> check_sizes(const SourceFile& file);
// Programmers read the .proto files as the description of what posed publishes: every field has a
// comment on its line.
[[nodiscard]] std::vector<Finding> check_field_comments(const SourceFile& file);
// TOML is parsed in proto/text/toml.cpp alone, which checks its depth first; outside of tests a
// whole file is read by load_file alone, which bounds it.
[[nodiscard]] std::vector<Finding> check_guarded_input(const SourceFile& file);
// A file that may not be reached, or a name that is too long, is a sentence and no exception:
// outside of tests, functions of std::filesystem that ask the system get an std::error_code as the
// last argument, and directories are walked by increment().
[[nodiscard]] std::vector<Finding> check_throwing_paths(const SourceFile& file);
// TRY is a whole statement, or the whole of what a variable is initialised with or assigned
// (proto/frame/result.hpp).
[[nodiscard]] std::vector<Finding> check_try(const SourceFile& file);
// Bodies of functions marked RT_SAFE (proto/frame/rt_safe.hpp), or called RT-safe in the comment
// above, neither allocate, lock, log, throw nor call the system.
// `bodies` counts the functions that were found, so that a test can verify that the check is
// effective.
[[nodiscard]] std::vector<Finding> check_hot_code(const SourceFile& file, int& bodies);

}  // namespace posed::tidy
