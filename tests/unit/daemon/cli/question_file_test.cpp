// The questions file: the documented sample, written and read back, and each way in which it can be
// wrong.
#include <catch2/catch.hpp>

#include <fstream>
#include <regex>

#include "daemon/cli/models/question_file.hpp"
#include "tests/support/shared.hpp"
#include "tests/support/temp_folder.hpp"

using namespace posed;
using namespace posed::cli;

namespace {

const auto kSample = test::source_dir() / "config/gestures/gcp134.toml";

std::string sample_text() {
  std::ifstream stream(kSample);
  return {std::istreambuf_iterator<char>(stream), {}};
}

// The error for the sample with `from` replaced by `to`.
Error refusal(const char* from, const char* to) {
  const test::TempFolder folder;
  const auto text = std::regex_replace(sample_text(), std::regex(from), to);
  const auto read = read_questions(folder.write("bad.toml", text));
  REQUIRE_FALSE(read.has_value());
  CHECK(read.error().exit_code == ExitCode::kWrongUse);
  CHECK(read.error().file.ends_with("bad.toml"));
  return read.error();
}

}  // namespace

TEST_CASE("The sample questions are the built-in set", "[questions]") {
  const auto labels = read_questions(kSample);
  REQUIRE(labels.has_value());
  CHECK(labels->size() == gesture::built_in_labels().size());
  for (const gesture::Label& built_in : gesture::built_in_labels()) {
    const auto same = std::ranges::find(*labels, built_in.name, &gesture::Label::name);
    REQUIRE(same != labels->end());
    CHECK(same->finger_class == built_in.finger_class);
  }
}

TEST_CASE("Written questions read back", "[questions]") {
  const test::TempFolder folder;
  std::vector<gesture::Label> labels = gesture::built_in_labels();
  labels[2].name = "\"\\,";
  REQUIRE(write_questions(labels, folder.path() / "q.toml").has_value());
  const auto read = read_questions(folder.path() / "q.toml");
  REQUIRE(read.has_value());
  const auto sorted = gesture::labels_of(gesture::lists_of(labels));
  CHECK(gesture::lists_of(*read) == gesture::lists_of(sorted.value()));
}

TEST_CASE("Invalid questions are refused", "[questions]") {
  CHECK(refusal("\\[ring\\]", "[rink]").message.find("[ring]") != std::string::npos);
  CHECK(refusal("B = ", "D = ").message.find("unknown key") != std::string::npos);
  CHECK(refusal("\"1\", \"3\", \"4\"\\]", "\"1\", \"3\"]").message.find("'4' is in no class") !=
        std::string::npos);
  CHECK(refusal("B = \\[\"c\"\\]", "B = [\"c\", \"g\"]").message.find("classes A and B") !=
        std::string::npos);
  CHECK(refusal("\"g\"", "\"no label\"").message.find("is no label") != std::string::npos);
  CHECK(refusal("A = \\[\"g\"", "A = \\[7").line > 0);
  CHECK(refusal("A = ", "A = = ").message.find("not TOML") != std::string::npos);
  CHECK_FALSE(read_questions("none.toml").has_value());
}
