// Findings: laid out once, rendered as JSON, as lines and as rows of a table.
#include "daemon/tools/command/findings.hpp"

#include <catch2/catch.hpp>

#include <cmath>

namespace posed::test {
using tools::Findings;

TEST_CASE("findings are JSON in the order in which they were added", "[findings]") {
  Findings findings;
  findings.add("frames", 3)
      .add("rms_deg", 1.5)
      .add("good", true)
      .add("out", "a.bvh")
      .add("gate", std::optional<double>())
      .add("ratio", std::nan(""))
      .add("weights", Findings().add("sad", 0.25))
      .add("warnings", std::vector<std::string>{"few", "uneven"})
      .add("clips", std::vector{Findings().add("clip", "a").say("a row")})
      .say("a line");
  CHECK(findings.json() ==
        R"({"frames":3,"rms_deg":1.5,"good":true,"out":"a.bvh","gate":null,"ratio":null,)"
        R"("weights":{"sad":0.25},"warnings":["few","uneven"],"clips":[{"clip":"a"}]})");
  CHECK(Findings().json() == "{}");
  CHECK(Findings().add({}, std::vector<int>{1, 2}).remark("few").json() == "[1,2]");
}

TEST_CASE("real numbers are shown as people write them", "[findings]") {
  CHECK(Findings().add("rate_hz", 100.00000000000213).json() == R"({"rate_hz":100.0})");
  CHECK(Findings().add("share", 0.1F).add("third", 1.0 / 3.0).json() ==
        R"({"share":0.1,"third":0.333333333333})");
}

TEST_CASE("a finding that is there already gets the new value in its place", "[findings]") {
  Findings findings;
  findings.add("a", 1).add("b", 2).add_all(Findings().add("a", "one"));
  CHECK(findings.json() == R"({"a":"one","b":2})");
}

TEST_CASE("findings come back from the JSON that a model keeps", "[findings]") {
  const std::string text =
      R"({"clips":[{"file":"a","xi":[0.5,-1]}],"difference_deg":12.5,"frames":7,"none":null,)"
      R"("nested":{"yes":true}})";
  const Findings findings = Findings().add_json(text);
  CHECK(findings.json() == text);
  CHECK(findings.number("difference_deg") == 12.5);
  CHECK(findings.number("frames") == 7.0);
  CHECK_FALSE(findings.number("clips"));
  CHECK_FALSE(findings.number("not there"));
  CHECK(Findings().add_json("[1]").json() == "{}");
  CHECK(Findings().add_json("no JSON").json() == "{}");
}

TEST_CASE("numbers have a row each, lists have none", "[findings]") {
  Findings findings;
  findings.add("frames", 1200)
      .add("kernel", Findings().add("length_deg", 1.0 / 3.0))
      .add("names", std::vector<std::string>{"a"})
      .add("good", false);
  using Rows = std::vector<std::vector<std::string>>;
  CHECK(findings.numbers() == Rows{{"frames", "1200"}, {"kernel.length_deg", "0.33333"}});
}

TEST_CASE("bad news ends a command with an exit code of its own", "[findings]") {
  CHECK(Findings().verdict("good", true).show(true) == 0);
  CHECK(Findings().verdict("bad", false).show(true) == 1);
  CHECK(Findings().add_all(Findings().verdict("bad", false)).show(true) == 1);
  CHECK(Findings().headline("bad", false).show(true) == 1);
}

}  // namespace posed::test
