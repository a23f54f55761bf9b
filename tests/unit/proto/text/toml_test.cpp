#include "proto/text/toml.hpp"

#include <catch2/catch.hpp>

#include "proto/frame/hand_shape.hpp"
#include "proto/frame/profile.hpp"
#include "tests/support/temp_folder.hpp"
#include "tests/support/toml_bombs.hpp"

namespace posed {
namespace {

constexpr TomlLimits kSmall{.what = "note", .bytes = 200'000, .depth = 4, .items = 100};

std::string toml_refusal(const std::string& text) {
  const auto parsed = parse_toml(text, "a.toml", kSmall);
  INFO(text.substr(0, 80));
  REQUIRE_FALSE(parsed);
  CHECK(parsed.error().message.size() < 500);
  return parsed.error().text();
}

bool passes(const std::string& text) {
  const auto parsed = parse_toml(text, "a.toml", kSmall);
  if (!parsed) UNSCOPED_INFO(parsed.error().text());
  return parsed.has_value();
}

TEST_CASE("TOML within its limits is read", "[toml]") {
  CHECK(passes(""));
  CHECK(passes("a = 1\nb.c.d.e = 2\n"));
  CHECK(passes("[a.b]\nc.d = 1\n[[e.f]]\ng = [1.5, 2.5]\n"));
  CHECK(passes("\xEF\xBB\xBF[a]\nb = {c = 1.0}\r\n"));
  CHECK(passes("x = [ # a comment ]]]\n  1.5, # and {\n 2.5 ]\nt = 2020-01-01T00:00:00.5Z\n"));
}

TEST_CASE("dots, brackets and quotes inside strings and comments do not count", "[toml]") {
  const std::string dots(500, '.');
  CHECK(passes("a = \"" + dots + "\\\"" + dots + "[[[[[[[\"\n"));
  CHECK(passes("a = '" + dots + "\\'\nb = 'it = {{{{{{'\n"));
  CHECK(passes("# don't " + dots + " \"\"\" [[[[[[\na = 1\n"));
  CHECK(passes("a = \"\"\"x\"\" \n" + dots + "\\\"\"\" [[[[[[ \"\"\"\"\"\nb.c = 1\n"));
  CHECK(passes("a = ''' '' " + dots + "\n[[[[[[ '''''\nb.c = 1\n"));
  CHECK(passes("\"" + dots + "\".b = ''\nc = \"\"\n"));
}

TEST_CASE("TOML that nests too deep is refused before it is parsed", "[toml]") {
  for (const std::string& bomb : test::toml_bombs()) {
    CHECK_THAT(toml_refusal(bomb), Catch::Contains("nests deeper"));
    // Preceded by text that could mislead the scan into taking the rest for a string or a comment.
    for (const char* before :
         {"a = \"\\\\\"\n", "a = '\\'\n", "a = \"\"\"x\"\"\"\"\"\n", "a = ''''x'''\n", "# \"\"\"\n",
          "# '''\n", "a = ['''\n''', \"\"] # '\n", "'#' = '#'\n", "\"#\\\"\" = {b = '#'}\n",
          "a = \"\"\n", "a = \"\"\"\\\n\\\"\"\"\"\n", "[\"a\"]\r\n"}) {
      INFO(before);
      CHECK_THAT(toml_refusal(before + bomb), Catch::Contains("nests deeper"));
    }
  }
}

TEST_CASE("the error message names the line, the limit and the kind of file", "[toml]") {
  CHECK(toml_refusal("a = 1\n\"\"\"\n\n\n\"\"\" = 2\nb.c.d.e.f = 1\n") ==
        "a.toml:6: nests deeper here than the 4 levels of a note (each part of a dotted key is "
        "one)");
  CHECK(toml_refusal("[a.b.c]\n[a.b.c.d.e]\n").starts_with("a.toml:2: nests deeper"));
  CHECK(toml_refusal(std::string(200'001, '#')) ==
        "a.toml: is larger than 195 KB: that is no note");
}

TEST_CASE("too many keys, tables or values are refused before they are parsed", "[toml]") {
  const auto repeated = [](const std::string& text, int times) {
    std::string all;
    for (int i = 0; i < times; ++i) all += text;
    return all;
  };
  CHECK(toml_refusal(repeated("[[a]]\n", 101)).contains("a.toml:101: has more than 100 keys"));
  CHECK(toml_refusal("a = [" + repeated("1,", 101) + "]").contains("has more than 100 keys"));
  CHECK(passes(repeated("[[a]]\n", 100)));
}

TEST_CASE("a mistake in TOML gives one error message with its line", "[toml]") {
  CHECK(toml_refusal("a = 1\nb = \x1b[2J\n").starts_with("a.toml:2: not TOML: "));
  CHECK(toml_refusal(std::string(100'000, 'k')).size() < 600);  // toml++ would repeat the whole key
  CHECK_FALSE(toml_refusal("\x1b\n").contains('\x1b'));
}

TEST_CASE("profiles and hands refuse TOML that is nested too deep", "[toml]") {
  for (const std::string& bomb : test::toml_bombs()) {
    CHECK(parse_profile(bomb, "p").error().message.contains("nests deeper"));
    CHECK(parse_hand_shape(bomb, "h").error().message.contains("nests deeper"));
  }
}

TEST_CASE("a TOML file is bounded like any file", "[toml]") {
  const test::TempFolder folder;
  CHECK(load_toml(folder.write("a.toml", "a = 1\n"), kSmall).value().contains("a"));
  CHECK(load_toml("/dev/zero", kSmall).error().message.contains("device or a pipe"));
  CHECK(load_toml(folder.path(), kSmall).error().message.contains("folder; name a note in it"));
}

}  // namespace
}  // namespace posed
