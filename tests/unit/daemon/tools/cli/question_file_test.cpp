// The questions file: the documented sample, written and read back, and each way in which it can be
// wrong.
#include <catch2/catch.hpp>

#include <fstream>
#include <regex>

#include "daemon/tools/gesture/question_file.hpp"
#include "tests/support/shared.hpp"
#include "tests/support/temp_folder.hpp"

using namespace posed;
using namespace posed::tools;

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
  const auto read = read_questions(kSample);
  REQUIRE(read.has_value());
  CHECK(read->is_hand());
  const std::vector<gesture::Label>* const labels = &read->labels;
  CHECK(labels->size() == gesture::built_in_labels().size());
  for (const gesture::Label& built_in : gesture::built_in_labels()) {
    const auto same = std::ranges::find(*labels, built_in.name, &gesture::Label::name);
    REQUIRE(same != labels->end());
    CHECK(same->group_class == built_in.group_class);
  }
}

TEST_CASE("Written questions read back", "[questions]") {
  const test::TempFolder folder;
  gesture::Vocabulary vocabulary = gesture::built_in_vocabulary();
  std::vector<gesture::Label>& labels = vocabulary.labels;
  labels[2].name = "\"\\,";
  REQUIRE(write_questions(vocabulary, folder.path() / "q.toml").has_value());
  const auto read = read_questions(folder.path() / "q.toml");
  REQUIRE(read.has_value());
  const auto sorted = gesture::labels_of(gesture::lists_of(labels));
  CHECK(gesture::lists_of(read->labels) == gesture::lists_of(sorted.value()));
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

namespace {

// The groups of raised arms, with a text in place of another.
Result<gesture::Vocabulary> arms_with(const char* from, const char* to) {
  const test::TempFolder folder;
  std::ifstream stream(test::source_dir() / "config/gestures/raise-arms.toml");
  const std::string text{std::istreambuf_iterator<char>(stream), {}};
  return read_questions(folder.write("arms.toml", std::regex_replace(text, std::regex(from), to)));
}

std::string arms_refusal(const char* from, const char* to) {
  const auto read = arms_with(from, to);
  return read ? "" : read.error().text();
}

}  // namespace

TEST_CASE("The groups of a body are read, and read back as written", "[questions]") {
  const auto read = arms_with("\\[head\\]", "named = [\"rest\"]\n[head]");
  REQUIRE(read.has_value());
  REQUIRE_FALSE(read->is_hand());
  REQUIRE(read->groups.size() == 5);
  CHECK(read->groups[1].name == "left-arm");
  CHECK(read->groups[1].classes == 2);
  CHECK(read->groups[4].classes == 1);
  CHECK(read->named == std::vector<int>{read->label_index("rest")});
  const int both = read->label_index("raise-both");
  REQUIRE(both >= 0);
  CHECK(read->labels[static_cast<std::size_t>(both)].group_class ==
        std::vector<int>{0, 1, 0, 1, 0});
  const test::TempFolder folder;
  REQUIRE(write_questions(*read, folder.path() / "q.toml").has_value());
  const auto again = read_questions(folder.path() / "q.toml");
  REQUIRE(again.has_value());
  CHECK(again->body->joints == read->body->joints);
  CHECK(gesture::lists_of(again->labels, again->groups) ==
        gesture::lists_of(read->labels, read->groups));
}

TEST_CASE("Groups of a body that are wrong are refused", "[questions]") {
  const auto mentions = [](const std::string& text, const char* what) {
    UNSCOPED_INFO(text);
    return text.find(what) != std::string::npos && text.find("arms.toml") != std::string::npos;
  };
  CHECK(mentions(arms_refusal("joints = \\[\"spine\", \"chest\"\\]", ""),
                 "group 'trunk' has no joints"));
  CHECK(mentions(arms_refusal("\"chest\"", "\"head\""), "groups overlap: joint 'head'"));
  CHECK(mentions(arms_refusal("\"spine\"", "\"back\""), "'back', which is no bone"));
  CHECK(mentions(arms_refusal("B = \\[\"raise-left\"", "D = [\"raise-left\""), "unknown key"));
  CHECK(mentions(arms_refusal("B = \\[\"raise-left\", ", "B = ["), "in no class of the left-arm"));
  CHECK(mentions(arms_refusal("\\[head\\]", "named = [\"wave\"]\n[head]"), "named has 'wave'"));
}
