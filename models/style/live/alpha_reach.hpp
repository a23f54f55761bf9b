// How far alpha may go on a figure before its arms run into its head or trunk. The trained style
// itself (alpha 1) is never limited. Cold.
#pragma once

#include <cstddef>
#include <vector>

namespace posed::style {

struct BoundModel;

inline constexpr double kMaxAlpha = 2.0;

struct AlphaReach {
  double low = -kMaxAlpha;
  double high = kMaxAlpha;  // at least 1
};

// One for each style. The trained walk (BoundModel::usual) is styled with growing alpha, and the
// forearms and hands are tried against a ball for the head and a rod for the trunk, in sizes of the
// shoulders. Without that walk, or where the figure lacks shoulders, hands or head, nothing is
// limited.
[[nodiscard]] std::vector<AlphaReach> alpha_reach(const BoundModel& model);

}  // namespace posed::style
