// Label files: seconds and HTK's units, written and read back, and every kind of mistake.
#include <catch2/catch.hpp>

#include "proto/clip/label_file.hpp"
#include "tests/support/temp_folder.hpp"

using namespace posed;
using namespace posed::clip;

namespace {

Error label_refusal(const std::string& text, double recording_s = 1e9) {
  const auto labels = parse_labels(text, "take.lab", recording_s);
  INFO(text);
  REQUIRE_FALSE(labels.has_value());
  CHECK(labels.error().file == "take.lab");
  return labels.error();
}

bool has(const Error& error, const std::string& what, int line) {
  UNSCOPED_INFO(error.text());
  return error.message.find(what) != std::string::npos && error.line == line;
}

}  // namespace

TEST_CASE("Labels in seconds", "[lab]") {
  const auto labels = parse_labels(
      "\xEF\xBB\xBF"
      "0 1.5 g\r\n\n 1.5\t2.25  c\n3 4 open-hand",
      "a");
  REQUIRE(labels.has_value());
  REQUIRE(labels->size() == 3);
  CHECK((*labels)[1].start_s == 1.5);
  CHECK((*labels)[1].end_s == 2.25);
  CHECK((*labels)[1].name == "c");
  CHECK((*labels)[2].line == 4);
  CHECK((*labels)[2].name == "open-hand");
}

TEST_CASE("HTK's units are known by their integers", "[lab]") {
  const auto htk = parse_labels("0 15000000 g\n15000000 30000000 c\n", "a");
  REQUIRE(htk.has_value());
  CHECK((*htk)[1].start_s == Approx(1.5));
  CHECK((*htk)[1].end_s == Approx(3.0));
  // Integers, but seconds: 10,000 s is a recording of three hours.
  CHECK((*parse_labels("0 4 g\n4 10000 c\n", "a"))[1].end_s == 10'000.0);
  // With one decimal point in the file, all times are seconds.
  CHECK((*parse_labels("0 4.0 g\n4 20000 c\n", "a"))[1].end_s == 20'000.0);
}

TEST_CASE("Labels that were written read back as the same", "[lab]") {
  const std::vector<LabelSegment> segments{{0.0, 1.0 / 3.0, "g", 1}, {1.0 / 3.0, 2.0, "1", 2}};
  const test::TempFolder folder;
  REQUIRE(write_labels(segments, folder.path() / "a.lab").has_value());
  const auto read = read_labels(folder.path() / "a.lab", 2.0);
  REQUIRE(read.has_value());
  CHECK(labels_text(*read) == labels_text(segments));
  CHECK_FALSE(write_labels(segments, folder.path() / "no" / "a.lab").has_value());
  CHECK_FALSE(read_labels(folder.path() / "none.lab").has_value());
}

TEST_CASE("Label files with mistakes are refused with the line", "[lab]") {
  CHECK(has(label_refusal(""), "no label in this file", 0));
  CHECK(has(label_refusal(" \n\n"), "no label in this file", 0));
  CHECK(has(label_refusal("0 1 g\n1 x c"), "is no time", 2));
  CHECK(has(label_refusal("0 1 g\n1 nan c"), "is no time", 2));
  CHECK(has(label_refusal("-1 1 g"), "below zero", 1));
  CHECK(has(label_refusal("0 1"), "no name", 1));
  CHECK(has(label_refusal("0"), "ends early", 1));
  CHECK(has(label_refusal("0 1 two words"), "more after the name", 1));
  CHECK(has(label_refusal("0 1 sixteen-letters-"), "is no label", 1));
  CHECK(has(label_refusal("0 1 na\x01me"), "is no label", 1));
  CHECK(has(label_refusal("0 1 g\n2 2 c"), "ends where it starts", 2));
  CHECK(has(label_refusal("0 1 g\n3 2 c"), "ends where it starts", 2));
  CHECK(has(label_refusal("0 1 g\n\n0.9 2 c"), "overlaps", 3));
  CHECK(has(label_refusal("2 3 g\n0 1 c"), "time order", 2));
  CHECK(has(label_refusal("0 1 g\n1 2.5 c", 2.0), "is this the right recording", 2));
}
