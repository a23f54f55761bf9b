// The drawings of the trees: text, Graphviz source, SVG.
#include <catch2/catch.hpp>

#include "models/gesture/tree_drawing.hpp"
#include "tests/unit/models/gesture/toy_gesture.hpp"

using namespace posed;
using namespace posed::gesture;

namespace {

std::size_t count(const std::string& text, const std::string& what) {
  std::size_t found = 0;
  for (auto at = text.find(what); at != std::string::npos; at = text.find(what, at + 1)) ++found;
  return found;
}

}  // namespace

TEST_CASE("A tree as text lists the contexts that reach each node", "[drawing]") {
  const auto text = trees_text(test::toy_gesture_model(), {.state = 3, .group = 2});
  CHECK(text ==
        "state 4, middle: 3 leaves\n"
        "  current is {g,1}?\n"
        "    yes  leaf 0, 100 frames: *-{g,1}-*\n"
        "    no   current is c?\n"
        "      yes  leaf 1, 100 frames: *-c-*\n"
        "      no   leaf 2, 100 frames: *-{p,3,4}-*\n");
}

TEST_CASE("Trees are chosen by finger and state", "[drawing]") {
  const GestureModel model = test::toy_gesture_model();
  const auto titles = [&](const char* choice) {
    return count(trees_text(model, tree_choice(choice).value()), "state ");
  };
  CHECK(titles("all") == 25);
  CHECK(titles("little") == 5);
  CHECK(titles("2") == 5);
  CHECK(titles("index:5") == 1);
  for (const char* wrong : {"", "toe", "6", "0", "index:", "index:9", "2:2", "index:22", ":2"}) {
    INFO(wrong);
    const auto refused = tree_choice(wrong);
    REQUIRE_FALSE(refused.has_value());
    CHECK(refused.error().exit_code == ExitCode::kWrongUse);
  }
}

TEST_CASE("Drawings have every node once, whatever the labels are called", "[drawing]") {
  GestureModel model = test::toy_gesture_model();
  model.labels[1].name = "<&\"\\>";
  int leaves = 0;
  int questions = 0;
  for (const DrawnTree& tree : draw_trees(model, {})) {
    for (const DrawnNode& node : tree.nodes) ++(node.yes < 0 ? leaves : questions);
  }
  CHECK(leaves == 75);
  CHECK(questions == 50);
  CHECK(count(trees_dot(model, {}), "->") == 100);
  const auto dot = trees_dot(model, {.state = 0, .group = 0});
  CHECK(count(dot, "->") == 4);
  CHECK(dot.find("<&\\\"\\\\>") != std::string::npos);
}
