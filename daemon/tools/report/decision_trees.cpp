// Trees from left to right, a leaf a row: so that the largest ones fit the width of a page.
#include <algorithm>

#include <spdlog/fmt/fmt.h>

#include "daemon/tools/report/gesture_sections.hpp"
#include "daemon/tools/report/look.hpp"

namespace posed::report {
namespace {

constexpr double kNodeHeight_px = 36.0, kRowGap_px = 8.0, kColumnGap_px = 40.0,
                 kTreeTitle_px = 26.0;
constexpr double kTreePad_px = 8.0;

class TreeDrawing {
 public:
  explicit TreeDrawing(const QuestionTree& tree)
      : tree_(tree), y_px_(tree.nodes.size(), 0.0), column_(tree.nodes.size(), 0) {
    if (tree.nodes.empty()) return;
    place(0, 0);
    x_px_.push_back(0.0);
    for (const double width : widths_) x_px_.push_back(x_px_.back() + width + kColumnGap_px);
  }

  [[nodiscard]] Drawing drawing() const {
    std::string out =
        fmt::format("<text x=\"0\" y=\"15\" font-weight=\"600\">{}</text>\n", escaped(tree_.title));
    for (std::size_t i = 0; i < tree_.nodes.size(); ++i) out += ways_of(i);
    for (std::size_t i = 0; i < tree_.nodes.size(); ++i) out += box_of(i);
    const double width = x_px_.empty() ? 0.0 : x_px_.back() - kColumnGap_px;
    return {.width_px = std::max(width, text_px(tree_.title)) + 2.0,
            .height_px = kTreeTitle_px + next_px_ + 4.0,
            .elements = std::move(out),
            .kind = "tree"};
  }

 private:
  // A node is in the middle of its leaves.
  double place(int node, std::size_t column) {
    const auto at = static_cast<std::size_t>(node);
    const QuestionNode& here = tree_.nodes[at];
    if (column >= widths_.size()) widths_.resize(column + 1, 0.0);
    widths_[column] = std::max(
        widths_[column], std::max(text_px(here.words), text_px(here.reach)) + 2.0 * kTreePad_px);
    column_[at] = column;
    if (here.yes < 0) {
      y_px_[at] = next_px_;
      next_px_ += kNodeHeight_px + kRowGap_px;
    } else {
      const double first = place(here.yes, column + 1);
      const double last = place(here.no, column + 1);
      y_px_[at] = (first + last) / 2.0;
    }
    return y_px_[at];
  }

  [[nodiscard]] double middle_px(std::size_t node) const {
    return kTreeTitle_px + y_px_[node] + kNodeHeight_px / 2.0;
  }

  [[nodiscard]] std::string ways_of(std::size_t node) const {
    const QuestionNode& here = tree_.nodes[node];
    std::string out;
    if (here.yes < 0) return out;
    const double from = x_px_[column_[node]] + widths_[column_[node]];
    for (const bool yes : {true, false}) {
      const auto child = static_cast<std::size_t>(yes ? here.yes : here.no);
      const double to = x_px_[column_[child]];
      const double bend = from + 12.0;
      out += fmt::format("<path class=\"way\" d=\"M{:.1f} {:.1f}H{:.1f}V{:.1f}H{:.1f}\"/>\n", from,
                         middle_px(node), bend, middle_px(child), to);
      out +=
          fmt::format("<text class=\"quiet\"{}{}>{}</text>\n", attribute("x", bend + 3.0),
                      attribute("y", middle_px(child) + (yes ? -4.0 : 14.0)), yes ? "yes" : "no");
    }
    return out;
  }

  [[nodiscard]] std::string box_of(std::size_t node) const {
    const QuestionNode& here = tree_.nodes[node];
    const double x = x_px_[column_[node]];
    const double y = middle_px(node) - kNodeHeight_px / 2.0;
    return fmt::format(
        "<rect class=\"{}\" rx=\"4\"{}{}{}{}/><text{}{}>{}</text><text "
        "class=\"quiet\"{}{}>{}</text>"
        "\n",
        here.yes < 0 ? "leaf" : "ask", attribute("x", x), attribute("y", y),
        attribute("width", widths_[column_[node]]), attribute("height", kNodeHeight_px),
        attribute("x", x + kTreePad_px), attribute("y", y + 15.0), escaped(here.words),
        attribute("x", x + kTreePad_px), attribute("y", y + 30.0), escaped(here.reach));
  }

  const QuestionTree& tree_;
  std::vector<double> y_px_;
  std::vector<std::size_t> column_;
  std::vector<double> widths_, x_px_;  // [column]
  double next_px_ = 0.0;
};

}  // namespace

Figure decision_trees(const std::string& title, const std::vector<QuestionTree>& trees,
                      bool folded) {
  Figure figure{.title = title,
                .sentence =
                    "Follow the answers from the left: every gesture, also one that was "
                    "never recorded, ends in a leaf, whose poses it shares. Below a "
                    "question stand the contexts that come there, before-gesture-after; "
                    "* is any label.",
                .drawings = {},
                .tables = {},
                .folded = folded};
  for (const QuestionTree& tree : trees) figure.drawings.push_back(TreeDrawing(tree).drawing());
  return figure;
}

}  // namespace posed::report
