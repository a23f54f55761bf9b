#include "proto/rig/figure.hpp"

#include <utility>

namespace posed::rig {

Figure::Figure(std::vector<RigJoint> joints)
    : joints_(std::move(joints)),
      children_(joints_.size()),
      depth_(joints_.size(), 1),
      begin_(joints_.size(), 0),
      end_(joints_.size(), 0),
      main_child_(joints_.size(), -1),
      chain_length_(joints_.size(), 1),
      reach_(joints_.size(), 0.0) {
  std::vector<int> count(joints_.size(), 1);  // joints at or below
  for (int j = size() - 1; j >= 0; --j) {
    const int parent = joints_[j].parent;
    reach_[j] = std::max(reach_[j], end_length(j));
    if (main_child_[j] >= 0) chain_length_[j] = chain_length_[main_child_[j]] + 1;
    if (parent < 0) continue;
    count[parent] += count[j];
    const double way = joints_[j].offset.norm() + reach_[j];
    // Of equal ways the first child's counts; children come last first here.
    const int best = main_child_[parent];
    if (best < 0 || way >= joints_[best].offset.norm() + reach_[best]) main_child_[parent] = j;
    reach_[parent] = std::max(reach_[parent], way);
  }
  std::vector<int> next(joints_.size(), 0);  // where the next child begins
  for (int j = 0; j < size(); ++j) {
    const int parent = joints_[j].parent;
    if (parent >= 0) {
      children_[parent].push_back(j);
      depth_[j] = depth_[parent] + 1;
      begin_[j] = next[parent];
      next[parent] += count[j];
    }
    end_[j] = begin_[j] + count[j];
    next[j] = begin_[j] + 1;
  }
}

double Figure::end_length(int joint) const {
  return joints_[joint].end_site ? joints_[joint].end_site->norm() : 0.0;
}

std::vector<int> Figure::path(int joint) const {
  std::vector<int> out;
  for (; joint >= 0; joint = joints_[joint].parent) out.push_back(joint);
  std::ranges::reverse(out);
  return out;
}

int Figure::common(const std::vector<int>& joints) const {
  if (joints.empty()) return 0;
  int at = joints.front();
  for (const int joint : joints) {
    while (!below(at, joint)) at = joints_[at].parent;
  }
  return at;
}

std::optional<Vec> Figure::between(int top, int joint) const {
  if (!below(top, joint)) return std::nullopt;
  Vec way = Vec::Zero();
  for (; joint != top; joint = joints_[joint].parent) way += joints_[joint].offset;
  return way;
}

std::vector<int> Figure::main_chain(int joint) const {
  std::vector<int> chain;
  for (; joint >= 0; joint = main_child_[joint]) chain.push_back(joint);
  return chain;
}

std::vector<double> Figure::segments(const std::vector<int>& chain) const {
  std::vector<double> out;
  for (std::size_t i = 1; i < chain.size(); ++i) out.push_back(joints_[chain[i]].offset.norm());
  out.push_back(end_length(chain.back()));
  return out;
}

}  // namespace posed::rig
