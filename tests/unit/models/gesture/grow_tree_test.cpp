// The decision tree against the fixture: likelihoods, the MDL stop, the exact tree, contexts that
// were not recorded.
#include <catch2/catch.hpp>

#include <cmath>
#include <set>

#include "models/gesture/grow_tree.hpp"
#include "tests/support/golden_json.hpp"

using namespace posed;
using namespace posed::gesture;
using nlohmann::json;

namespace {

constexpr double kTreeTolerance = 1e-6;

struct TreeFixture {
  json golden = test::golden_json("mdl.json");
  ContextSums sums;
  Answers answers;
  Eigen::VectorXd floor = test::vector(golden["var_floor"]);
  GrowOptions options{
      .mdl_factor = 1.0, .min_occupancy = 0, .min_examples = 0, .counted = {0, 1, 2}};

  TreeFixture() {
    sums = {test::vector(golden["occ"]), Eigen::VectorXd::Ones(12), test::matrix(golden["s1"]),
            test::matrix(golden["s2"])};
    for (const json& question : golden["questions"]) {
      auto& row = answers.emplace_back();
      for (const json& context : golden["contexts"]) row.push_back(says_yes(question, context));
    }
  }

  static bool says_yes(const json& question, const json& context) {
    const auto set = question["set"].get<std::set<std::string>>();
    return set.contains(context[question["pos"].get<std::size_t>()].get<std::string>());
  }

  void compare(const GrownTree& tree, int node, const json& expected) const {
    const TreeNode& got = tree.nodes[node];
    if (expected.contains("leaf")) {
      REQUIRE(got.leaf >= 0);
      CHECK(tree.members[got.leaf] == expected["members"].get<std::vector<int>>());
      CHECK((tree.mean.row(got.leaf).transpose() - test::vector(expected["mean"])).norm() <
            kTreeTolerance);
      CHECK((tree.variance.row(got.leaf).transpose() - test::vector(expected["var"])).norm() <
            kTreeTolerance);
      CHECK(tree.occupancy[got.leaf] == Approx(expected["occ"].get<double>()).epsilon(1e-12));
      return;
    }
    REQUIRE(got.question == expected["q"].get<int>());
    CHECK(std::abs(tree.gain[node] - expected["gain"].get<double>()) < kTreeTolerance);
    compare(tree, got.yes, expected["yes"]);
    compare(tree, got.no, expected["no"]);
  }
};

}  // namespace

TEST_CASE_METHOD(TreeFixture, "The tree is the fixture's", "[tree]") {
  const GrownTree tree = grow_tree(sums, answers, floor, options);
  CHECK(std::abs(tree.threshold - golden["threshold"].get<double>()) < kTreeTolerance);
  CHECK(std::abs(tree.gain[0] - golden["gain_cur_fist_like"].get<double>()) < kTreeTolerance);
  compare(tree, 0, golden["tree"]);
}

TEST_CASE_METHOD(TreeFixture, "A dearer split gives the fixture's smaller tree", "[tree]") {
  options.mdl_factor = 4.0;
  const GrownTree tree = grow_tree(sums, answers, floor, options);
  CHECK(std::abs(tree.threshold - golden["alpha4"]["threshold"].get<double>()) < kTreeTolerance);
  compare(tree, 0, golden["alpha4"]["tree"]);
}

TEST_CASE_METHOD(TreeFixture, "Contexts that were never seen find their leaf", "[tree]") {
  const GrownTree tree = grow_tree(sums, answers, floor, options);
  for (const json& unseen : golden["unseen"]) {
    int node = 0;
    while (tree.nodes[node].leaf < 0) {
      const json& question = golden["questions"][tree.nodes[node].question];
      node = says_yes(question, unseen["ctx"]) ? tree.nodes[node].yes : tree.nodes[node].no;
    }
    CHECK(tree.members[tree.nodes[node].leaf] == unseen["leaf_members"].get<std::vector<int>>());
  }
}

TEST_CASE_METHOD(TreeFixture, "No leaf sees less than the minimum", "[tree]") {
  options.mdl_factor = 0.0;
  options.min_occupancy = 200.0;
  options.min_examples = 3.0;
  const GrownTree tree = grow_tree(sums, answers, floor, options);
  REQUIRE(tree.members.size() > 1);
  CHECK(tree.occupancy.minCoeff() >= 200.0);
  for (const auto& members : tree.members) CHECK(members.size() >= 3);
}

TEST_CASE_METHOD(TreeFixture, "A finger that never moves is one leaf", "[tree]") {
  options.counted.clear();
  const GrownTree tree = grow_tree(sums, answers, floor, options);
  CHECK(tree.nodes.size() == 1);
  CHECK(tree.members.front().size() == 12);
}
