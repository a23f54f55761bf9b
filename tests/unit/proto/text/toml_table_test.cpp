// Reading of values from TOML tables: what is accepted, and the error for everything else.
#include "proto/text/toml_table.hpp"

#include <catch2/catch.hpp>

namespace posed {
namespace {

constexpr std::array<std::string_view, 3> kColours{"red", "green", "blue"};

// Reads `text` and returns its errors as "line: message".
template <typename Read>
std::vector<std::string> errors_of(const std::string& text, Read&& read, Findings findings = {}) {
  const auto root = parse_toml(text, "a.toml", {});
  REQUIRE(root);
  TableReader reader(*root, "", findings);
  read(reader);
  std::vector<std::string> errors;
  for (const Error& error : findings.errors) {
    errors.push_back(std::to_string(error.line) + ": " + error.message);
  }
  return errors;
}

template <typename Read>
std::string error_of(const std::string& text, Read&& read) {
  const auto errors = errors_of(text, read);
  REQUIRE(errors.size() == 1);
  return errors[0];
}

using Strings = std::vector<std::string>;

TEST_CASE("values of every type are read", "[toml_table]") {
  const char* text = R"(flag = true
whole = -3
real = 2
text = "a"
texts = ["a", "b"]
ids = [0, 0xFFFFFFFF]
colour = "blue"
bytes = "24 0a57"
three = [1, 2.5, -3]
pairs = [[1, 2], [3, 4.5]]
[names]
b = 1
a = 2
)";
  CHECK(errors_of(text, [](TableReader& reader) {
          bool flag = false;
          int whole = 0;
          double real = 0.0;
          std::string word;
          Strings words{"default"};
          std::vector<std::uint32_t> ids;
          reader.read("flag", flag);
          reader.read("whole", whole, {-3, 3});
          reader.read("real", real, {2, 3});
          reader.require("text", word);
          reader.read("texts", words);
          reader.read("ids", ids);
          CHECK(flag);
          CHECK(whole == -3);
          CHECK(real == 2.0);
          CHECK(word == "a");
          CHECK(words == Strings{"a", "b"});
          CHECK(ids == std::vector<std::uint32_t>{0, 0xFFFFFFFF});
          CHECK(reader.choice("colour", kColours) == 2);
          CHECK(reader.hex("bytes", 3) ==
                std::vector<std::byte>{std::byte{0x24}, std::byte{0x0A}, std::byte{0x57}});
          CHECK(reader.numbers<3>("three", {-3, 3}) == std::array{1.0, 2.5, -3.0});
          CHECK(reader.pairs("pairs", {0, 9}) == TableReader::Pairs{{1.0, 2.0}, {3.0, 4.5}});
          auto names = reader.table("names");
          REQUIRE(names);
          CHECK(names->keys() == Strings{"a", "b"});
          reader.finish();
        }).empty());
}

TEST_CASE("without a key the default stays and nothing is an error", "[toml_table]") {
  CHECK(errors_of("", [](TableReader& reader) {
          Strings words{"default"};
          reader.read("texts", words);
          CHECK(words == Strings{"default"});
          CHECK(reader.choice("colour", kColours) == 0);
          CHECK(reader.hex("bytes", 3).empty());
          CHECK_FALSE(reader.numbers<3>("three", {0, 1}));
          CHECK_FALSE(reader.pairs("pairs", {0, 1}));
          CHECK_FALSE(reader.table("names"));
          CHECK(reader.tables("list", 3).empty());
          reader.finish();
        }).empty());
}

TEST_CASE("a key that is required is there", "[toml_table]") {
  const auto name = [](TableReader& reader) {
    std::string value;
    reader.require("name", value);
  };
  CHECK(errors_of("name = 'a'", name).empty());
  CHECK(error_of("", name) == "1: name is missing; give it a text in quotes");
}

TEST_CASE("the error for a wrong value says what it must be", "[toml_table]") {
  const auto three = [](TableReader& reader) { CHECK_FALSE(reader.numbers<3>("v", {0, 9})); };
  CHECK(error_of("v = [1, 2]", three) == "1: v must be a list of 3 numbers, not a list of 2");
  CHECK(error_of("v = [1, 2, 10]", three) ==
        "1: v = 10 is out of range: it takes a number from 0 to 9");
  CHECK(error_of("v = [1, 2,\nnan]", three).starts_with("2: v = nan is out of range"));
  // 2^53 + 1: a double cannot hold it exactly
  CHECK(error_of("v = [1, 2, 9007199254740993]", three).starts_with("1: v = 9"));
  CHECK(error_of("v = [1, 2, '3']", three) == "1: v must be a number, not text");
  const auto pairs = [](TableReader& reader) { CHECK_FALSE(reader.pairs("v", {0, 9})); };
  CHECK(error_of("v = 1", pairs) ==
        "1: v must be a list of pairs of numbers ([[0, 1], [2, 3]]), not an integer");
  CHECK(error_of("v = [[1, 2],\n[3]]", pairs) ==
        "2: v must be a list of 2 numbers, not a list of 1");
  const auto hex = [](TableReader& reader) { CHECK(reader.hex("v", 2).empty()); };
  for (const char* wrong : {"'1'", "'1g'", "'010'", "'01 02 03'", "'0x1'", "1"}) {
    CHECK(error_of(std::string("v = ") + wrong, hex) ==
          "1: v must be up to 2 bytes of two hexadecimal digits each, as \"24 0a 57\"");
  }
  const auto ids = [](TableReader& reader) {
    std::vector<std::uint32_t> values;
    reader.read("v", values);
  };
  CHECK(error_of("v = [-1]", ids).ends_with("it takes an integer from 0 to 4294967295"));
  CHECK(error_of("v = [1.5]", ids) == "1: v must be an integer, not a number");
  const auto colour = [](TableReader& reader) { CHECK(reader.choice("v", kColours) == 0); };
  CHECK(error_of("v = 'pink'", colour) ==
        "1: v must be one of these words in quotes: red, green, blue");
  const auto list = [](TableReader& reader) { CHECK(reader.tables("v", 1).empty()); };
  CHECK(error_of("v = [1]", list) == "1: v must be a list of tables ([[v]]), not a list of 1");
  CHECK(error_of("[[v]]\n[[v]]", list) == "1: there are 2 [[v]] tables; posed takes at most 1");
  CHECK(errors_of("v = []", list).empty());
  const auto need = [](TableReader& reader) {
    CHECK_FALSE(reader.need("v", "write it"));
    reader.finish();
  };
  CHECK(error_of("", need) == "1: v is missing; write it");
}

TEST_CASE("a key from the file is cleaned and cut in an error", "[toml_table]") {
  const std::string key = "\\u001b" + std::string(5000, 'k');
  const std::string error = error_of("\"" + key + "\" = 1", [](TableReader& reader) {
    std::string value;
    reader.read(reader.keys()[0], value);
  });
  CHECK(error.starts_with("1: \\x1bkkk"));
  CHECK(error.ends_with("... must be text in quotes, not an integer"));
}

TEST_CASE("the error for an unknown key says what was meant", "[toml_table]") {
  const auto two = [](TableReader& reader) {
    bool flag = false;
    reader.read("flag", flag);
    reader.skip("absent");
    reader.skip("refused");
    for (const char* name : {"original", "copy", "other"}) {
      if (auto table = reader.table(name)) table->finish();
    }
    reader.finish();
  };
  CHECK(errors_of("flog = true\nxyzzy = 1\nrefused = 1", two) ==
        Strings{"1: unknown key 'flog'; the nearest known one here is 'flag'",
                "2: unknown key 'xyzzy'; known here: copy, flag, original, other, refused"});
  const Findings of_twins{.file = {},
                          .all_keys = {"original.size", "copy.size", "copy.count"},
                          .twins = {.original = "original", .copy = "copy"}};
  const auto meant = [&](const std::string& table, const std::string& key) {
    const auto errors = errors_of("[" + table + "]\n" + key + " = 1", two, of_twins);
    REQUIRE(errors.size() == 1);
    return errors[0].substr(errors[0].find("; ") + 2);
  };
  CHECK(meant("other", "size") == "it belongs in [original]");
  CHECK(meant("other", "count") == "it belongs in [copy]");
  CHECK(meant("original", "count") == "it belongs in [copy]");
}

TEST_CASE("a single error is that of the smallest line, however many there are", "[toml_table]") {
  Findings findings{.file = "a.toml", .exit_code = ExitCode::kWrongUse};
  CHECK(findings.result(7).value() == 7);
  for (int line = 1000; line > 0; --line) findings.add_error(line, "wrong");
  REQUIRE(findings.errors.size() == kMaxErrors + 1);
  CHECK(findings.errors.back().message.starts_with("and there are more"));
  const auto first = findings.result(7);
  REQUIRE_FALSE(first);
  CHECK(first.error().text() == "a.toml:901: wrong");
  CHECK(first.error().exit_code == ExitCode::kWrongUse);
}

}  // namespace
}  // namespace posed
