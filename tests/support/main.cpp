// main() of the test programs. Beside the options of Catch2: `--part 2/3` runs every third of the
// chosen test cases, from the second on, so that a program that mostly waits can run in several
// processes.
#define CATCH_CONFIG_RUNNER
#include <catch2/catch.hpp>

#include <cstdio>
#include <string>
#include <string_view>

namespace {

// A name that Catch2 takes literally, whatever characters it has.
std::string literal(const std::string& name) {
  std::string text;
  for (const char c : name) {
    if (std::string_view(",[]\"\\").contains(c)) text += '\\';
    text += c;
  }
  return text;
}

// False if `part` is not I/N with I from 1 to N.
bool choose(const std::string& part, Catch::Session& session) {
  std::size_t mine = 0, parts = 0;
  char more = '\0';
  if (std::sscanf(part.c_str(), "%zu/%zu%c", &mine, &parts, &more) != 2) return false;
  if (mine < 1 || mine > parts) return false;
  const Catch::Config& config = session.config();
  Catch::ConfigData chosen = session.configData();
  chosen.testsOrTags.clear();
  std::size_t place = 0;
  for (const Catch::TestCase& test : Catch::getAllTestCasesSorted(config)) {
    const bool runs = config.hasTestFilters() ? Catch::matchTest(test, config.testSpec(), config)
                                              : !test.isHidden();
    if (!runs || place++ % parts != mine - 1) continue;
    if (!chosen.testsOrTags.empty()) chosen.testsOrTags.emplace_back(",");
    chosen.testsOrTags.push_back(literal(test.name));
  }
  if (chosen.testsOrTags.empty())
    chosen.testsOrTags.emplace_back("~*");  // none; an empty list means all
  session.useConfigData(chosen);
  return true;
}

}  // namespace

int main(int argc, char** argv) {
  Catch::Session session;
  std::string part;
  session.cli(session.cli() |
              Catch::clara::Opt(part, "i/n")["--part"]("every n-th test, from i on"));
  if (const int wrong = session.applyCommandLine(argc, argv); wrong != 0) return wrong;
  if (!part.empty() && !choose(part, session)) {
    std::fprintf(stderr, "--part %s: give I/N, with I from 1 to N\n", part.c_str());
    return 2;
  }
  return session.run();
}
