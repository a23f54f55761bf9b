#include "daemon/tools/command/options.hpp"

#include <algorithm>
#include <sstream>

#include <catch2/catch.hpp>

#include "daemon/tools/cli.hpp"

namespace posed::tools {
namespace {

// What the command line says to `--amount TEXT`; empty: it takes it.
std::string refusal(const CLI::Validator& check, const std::string& text) {
  CLI::App app;
  double amount = 0.0;
  app.add_option("--amount", amount)->check(check);
  try {
    app.parse("--amount=" + text);
  } catch (const CLI::ParseError& error) {
    return error.what();
  }
  return {};
}

TEST_CASE("no argument of a refused command line reaches the terminal as it is") {
  for (const char* line :
       {"top --timeout '\x1b[2J'", "top '\x1b[2J\n%s%n'", "devices --foo='\x1b[2J'",
        "ctl warm-up a '\xff\x1b'", "eval natural '\x1b]0;x\x07'"}) {
    CAPTURE(line);
    CLI::App app;
    int exit_code = 0;
    add_commands(app, exit_code);
    std::ostringstream out, err;
    try {
      app.parse(line);
      FAIL("it is taken");
    } catch (const CLI::ParseError& error) {
      CHECK(app.exit(error, out, err) != 0);
    }
    CHECK(out.str().empty());
    CHECK(std::ranges::count(err.str(), '\n') == 2);
    CHECK(std::ranges::none_of(err.str(),
                               [](char c) { return (c < ' ' && c != '\n') || c == '\x7f'; }));
  }
}

TEST_CASE("an option that takes a number takes no NaN and no infinity") {
  for (const char* text : {"nan", "-nan", "NAN", "inf", "-inf", "1e999", "x", "1x"}) {
    CAPTURE(text);
    CHECK(refusal(in_range(0.25, 4.0), text) ==
          "--amount: '" + std::string(text) + "' should be a number from 0.25 to 4");
    CHECK(refusal(above_zero(), text) ==
          "--amount: '" + std::string(text) + "' should be a number above 0");
  }
}

TEST_CASE("an option that takes a number takes its bounds, and nothing beyond") {
  for (const char* text : {"0.25", "4", "+1", "1e0"})
    CHECK(refusal(in_range(0.25, 4.0), text).empty());
  for (const char* text : {"0.24", "4.01", "-1"})
    CHECK(!refusal(in_range(0.25, 4.0), text).empty());
  CHECK(!refusal(above_zero(), "0").empty());
}

}  // namespace
}  // namespace posed::tools
