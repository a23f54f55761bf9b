#include "proto/text/clean.hpp"

#include <catch2/catch.hpp>

#include <string>

#include <nlohmann/json.hpp>

#include "proto/frame/result.hpp"
#include "proto/text/json_text.hpp"

namespace posed {
namespace {

TEST_CASE("terminal escape characters are written out", "[clean]") {
  CHECK(clean("index_mcp") == "index_mcp");
  CHECK(clean("\x1b[2J\x07") == "\\x1b[2J\\x07");
  CHECK(clean("two\nlines\r\tof\x7f") == "two\\nlines\\r\\tof\\x7f");
  CHECK(clean(std::string_view("a\0b", 3)) == "a\\x00b");
  CHECK(clean("\u009b31m") == "\\u{009b}31m");  // CSI in one character
  CHECK(clean("txt.\u202Egpj") == "txt.\\u{202e}gpj");
}

TEST_CASE("letters of any script are kept, bytes that are not UTF-8 are written out", "[clean]") {
  CHECK(clean("Gänsefüßchen 手 🖐") == "Gänsefüßchen 手 🖐");
  CHECK(clean("\xff\xc3") == "\\xff\\xc3");               // no lead byte, cut off
  CHECK(clean("\xc0\xaf") == "\\xc0\\xaf");               // '/' in too many bytes
  CHECK(clean("\xed\xa0\x80") == "\\xed\\xa0\\x80");      // half of a surrogate pair
  CHECK(clean("\xf4\x90\x80\x80x").ends_with("\\x80x"));  // beyond Unicode
}

TEST_CASE("JSON shows what a terminal would obey, and means the same", "[clean]") {
  const std::string hostile = "a\u2066\u202e\u009b\u00ad\ufeff\U000e0041\x7f\x1b 手\n";
  for (const int indent : {-1, 2}) {
    const std::string text = json_text(nlohmann::json{{"name", hostile}, {"n", 1}}, indent);
    CHECK(text.contains("\\u2066\\u202e\\u009b\\u00ad\\ufeff\\udb40\\udc41\\u007f\\u001b 手"));
    CHECK(nlohmann::json::parse(text).at("name") == hostile);
  }
  CHECK(clean("a\u00ad\U000e0041") == "a\\u{00ad}\\u{e0041}");
}

TEST_CASE("what is too long ends in dots, between two characters", "[clean]") {
  CHECK(clean("abcdef", 6) == "abcdef");
  CHECK(clean("abcdefg", 6) == "abcdef...");
  CHECK(clean("ab手", 4) == "ab...");
  CHECK(clean("abc\x1b", 6) == "abc...");  // an escape is not cut either
  const std::string megabyte(1 << 20, 'x');
  CHECK(clean(megabyte).size() == kMaxLineBytes + 3);
  CHECK(in_quotes(megabyte) == "'" + std::string(kMaxNameBytes, 'x') + "...'");
}

TEST_CASE("an error is safe for a terminal whatever it names", "[clean]") {
  const Error error{.message = "no joint \x1b[2J", .file = "a\nb.bvh", .line = 3};
  CHECK(error.text() == "a\\nb.bvh:3: no joint \\x1b[2J");
  const Error huge{.message = std::string(1 << 20, 'x'), .file = {}};
  CHECK(huge.text().size() < 3000);
}

}  // namespace
}  // namespace posed
