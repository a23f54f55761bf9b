#include "models/gesture/grow_tree.hpp"

#include <cmath>
#include <numbers>
#include <optional>
#include <utility>

namespace posed::gesture {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
using Rows = std::vector<int>;

constexpr double kTie =
    1e-9;  // gains closer than this are equal: rounding must not decide between them

struct Pool {
  double occupancy = 0.0, examples = 0.0;
  VectorXd mean, variance;
};

struct Split {
  double gain;
  int question;
  Rows yes, no;
};

class Grower {
 public:
  Grower(const ContextSums& sums, const Answers& answers, const VectorXd& floor,
         const GrowOptions& options)
      : sums_(sums), answers_(answers), floor_(floor), options_(options) {
    tree_.threshold = options.mdl_factor * static_cast<double>(options.counted.size()) *
                      std::log(sums.occupancy.sum());
  }

  // Appends the subtree over `rows` and returns its root's index.
  int grow(Rows rows) {
    const auto index = static_cast<int>(tree_.nodes.size());
    tree_.nodes.emplace_back();
    tree_.gain.push_back(0.0);
    auto split = best_split(rows);
    if (!split || split->gain <= tree_.threshold) {
      tree_.nodes[index].leaf = static_cast<int>(tree_.members.size());
      tree_.members.push_back(std::move(rows));
      return index;
    }
    tree_.nodes[index].question = split->question;
    tree_.gain[index] = split->gain;
    const int yes = grow(std::move(split->yes));
    const int no = grow(std::move(split->no));
    tree_.nodes[index].yes = yes;
    tree_.nodes[index].no = no;
    return index;
  }

  GrownTree finish() {
    const auto leaves = static_cast<Index>(tree_.members.size());
    tree_.mean.resize(leaves, sums_.first.cols());
    tree_.variance.resize(leaves, sums_.first.cols());
    tree_.occupancy.resize(leaves);
    for (Index leaf = 0; leaf < leaves; ++leaf) {
      const Pool all = pool(tree_.members[leaf]);
      tree_.mean.row(leaf) = all.mean;
      tree_.variance.row(leaf) = all.variance;
      tree_.occupancy[leaf] = all.occupancy;
    }
    return std::move(tree_);
  }

 private:
  Pool pool(const Rows& rows) const {
    Pool all;
    all.mean = all.variance = VectorXd::Zero(sums_.first.cols());
    for (const int row : rows) {
      all.occupancy += sums_.occupancy[row];
      all.examples += sums_.examples[row];
      all.mean += sums_.first.row(row);
      all.variance += sums_.second.row(row);
    }
    all.mean /= all.occupancy;
    all.variance = (all.variance / all.occupancy - all.mean.cwiseAbs2()).cwiseMax(floor_);
    return all;
  }

  // The pooled Gaussian's log likelihood of its own data over the dimensions that count.
  double log_likelihood(const Pool& all) const {
    double sum =
        static_cast<double>(options_.counted.size()) * (1.0 + std::log(2.0 * std::numbers::pi));
    for (const int d : options_.counted) sum += std::log(all.variance[d]);
    return -0.5 * all.occupancy * sum;
  }

  [[nodiscard]] bool seen_enough(const Pool& all) const {
    return all.occupancy >= options_.min_occupancy && all.examples >= options_.min_examples;
  }

  std::optional<Split> best_split(const Rows& rows) const {
    const double whole = log_likelihood(pool(rows));
    std::optional<Split> best;
    for (std::size_t q = 0; q < answers_.size(); ++q) {
      Rows yes, no;
      for (const int row : rows) (answers_[q][row] ? yes : no).push_back(row);
      if (yes.empty() || no.empty()) continue;
      const Pool of_yes = pool(yes);
      const Pool of_no = pool(no);
      if (!seen_enough(of_yes) || !seen_enough(of_no)) continue;
      const double gain = log_likelihood(of_yes) + log_likelihood(of_no) - whole;
      if (!best || gain > best->gain + kTie) {
        best = Split{gain, static_cast<int>(q), std::move(yes), std::move(no)};
      }
    }
    return best;
  }

  const ContextSums& sums_;
  const Answers& answers_;
  const VectorXd& floor_;
  const GrowOptions& options_;
  GrownTree tree_;
};

}  // namespace

GrownTree grow_tree(const ContextSums& sums, const Answers& answers, const VectorXd& floor,
                    const GrowOptions& options) {
  Grower grower(sums, answers, floor, options);
  Rows all(static_cast<std::size_t>(sums.occupancy.size()));
  for (std::size_t row = 0; row < all.size(); ++row) all[row] = static_cast<int>(row);
  grower.grow(std::move(all));
  return grower.finish();
}

}  // namespace posed::gesture
