// Commands of the pages that run tests, beside the tests that there are.
#include <algorithm>
#include <cctype>
#include <fstream>
#include <iterator>
#include <regex>
#include <set>

#include "tests/unit/tidy/source_tree.hpp"

namespace posed::tidy {
namespace {

// Catch2 takes [.day] for [.] and [day].
std::string split_hidden(const std::string& tags) {
  static const std::regex kHidden(R"(\[\.(\w+)\])");
  return std::regex_replace(tags, kHidden, "[.][$1]");
}

std::string in_small_letters(std::string text) {
  std::ranges::transform(text, text.begin(), [](unsigned char c) { return std::tolower(c); });
  return text;
}

// Catch2's rule: all of the tags, or the name without regard to case, with `*` at its ends.
bool names_test(const std::string& filter, const TestCase& test) {
  if (filter.starts_with('[')) {
    static const std::regex kTag(R"(\[[^\]]*\])");
    const std::string tags = split_hidden(filter);
    const std::sregex_token_iterator first(tags.begin(), tags.end(), kTag);
    return std::all_of(first, {}, [&](const auto& tag) { return test.tags.contains(tag.str()); });
  }
  const bool open_start = filter.starts_with('*');
  const bool open_end = filter.ends_with('*');
  const std::string name = in_small_letters(test.name);
  const std::string words =
      in_small_letters(filter.substr(open_start, filter.size() - open_start - open_end));
  if (open_start && open_end) return name.contains(words);
  if (open_start) return name.ends_with(words);
  return open_end ? name.starts_with(words) : name == words;
}

bool is_in(const std::string& folder, const Target& program) {
  return std::ranges::find(program.folders, folder) != program.folders.end();
}

}  // namespace

std::vector<TestCase> tests_of(const SourceFile& file) {
  static const std::regex kTest(
      R"re((?:TEST_CASE|TEMPLATE_TEST_CASE)\(\s*((?:"(?:[^"\\]|\\.)*"\s*)+)(?:,\s*("[^"]*"))?)re");
  static const std::regex kQuotes(R"re("\s*")re");
  std::string text;
  for (const std::string& line : file.lines) text += line + '\n';
  std::vector<TestCase> tests;
  for (std::sregex_iterator at(text.begin(), text.end(), kTest), end; at != end; ++at) {
    const std::string quoted = std::regex_replace((*at)[1].str(), kQuotes, "");
    tests.push_back({.folder = file.path.substr(0, file.path.rfind('/')),
                     .name = quoted.substr(1, quoted.rfind('"') - 1),
                     .tags = split_hidden((*at)[2].str())});
  }
  return tests;
}

std::vector<Finding> check_test_commands(const std::string& path, const std::string& text,
                                         const std::vector<TestCase>& tests,
                                         const std::vector<Target>& programs) {
  static const std::regex kCommand(R"re(\b(\w+) "([^"`\n]+)")re");
  static const std::regex kFilter("[^,]+");
  std::vector<Finding> findings;
  for (std::sregex_iterator at(text.begin(), text.end(), kCommand), end; at != end; ++at) {
    const auto program = std::ranges::find(programs, (*at)[1].str(), &Target::name);
    if (program == programs.end()) continue;
    const std::string filters = (*at)[2].str();
    for (std::sregex_iterator one(filters.begin(), filters.end(), kFilter); one != end; ++one) {
      const auto is_named = [&](const TestCase& test) {
        return is_in(test.folder, *program) && names_test(one->str(), test);
      };
      if (std::ranges::any_of(tests, is_named)) continue;
      const auto line = std::count(text.begin(), text.begin() + at->position(), '\n') + 1;
      findings.push_back({path, static_cast<int>(line),
                          "no test of " + program->name + " is named by \"" + one->str() + "\""});
    }
  }
  return findings;
}

}  // namespace posed::tidy
