// The SVG drawing of the trees: leaves are side by side, every other node is above the middle of
// its children, and the trees are stacked.
#include <algorithm>
#include <cmath>

#include "models/gesture/tree_drawing.hpp"
#include "proto/text/svg.hpp"

namespace posed::gesture {
namespace {

constexpr double kLetter = 7.0;  // width of a letter at 12 px
constexpr double kBoxHeight = 40.0, kLevel = 84.0, kGap = 14.0, kTitle = 34.0, kMargin = 16.0;

struct Placed {
  double x = 0.0, width = 0.0;  // of the box: centre and width
};

class Picture {
 public:
  void add(const DrawnTree& tree) {
    std::vector<Placed> placed(tree.nodes.size());
    double right = kMargin;
    place(tree, 0, placed, right);
    text(kMargin, top_ + 20.0, tree.title, "title");
    int depth = 0;
    for (std::size_t i = 0; i < tree.nodes.size(); ++i) {
      depth = std::max(depth, tree.nodes[i].depth);
      branches(tree, i, placed);
    }
    for (std::size_t i = 0; i < tree.nodes.size(); ++i) box(tree.nodes[i], placed[i]);
    top_ += kTitle + depth * kLevel + kBoxHeight + 2.0 * kGap;
    const double title_width = static_cast<double>(tree.title.size()) * kLetter * 1.2;
    width_ = std::max({width_, right, kMargin + title_width});
  }

  [[nodiscard]] std::string svg() const {
    return svg_document(width_ + kMargin, top_ + kMargin,
                        "text{font:12px sans-serif;text-anchor:middle}"
                        ".title{font:bold 14px sans-serif;text-anchor:start}.reach{fill:#666}"
                        "line{stroke:#888}.ask{fill:#fff;stroke:#444}"
                        ".leaf{fill:#e4f0e0;stroke:#5a8a4a}",
                        body_);
  }

 private:
  // Places the leaves below `node` to the right of `right`, and the node above them.
  void place(const DrawnTree& tree, int node, std::vector<Placed>& placed, double& right) const {
    const DrawnNode& at = tree.nodes[node];
    Placed& here = placed[node];
    here.width = kLetter * static_cast<double>(std::max(at.words.size(), at.reach.size())) + 12.0;
    const double left = right;
    if (at.yes < 0) {
      here.x = left + here.width / 2.0;
    } else {
      place(tree, at.yes, placed, right);
      place(tree, at.no, placed, right);
      here.x = std::max((placed[at.yes].x + placed[at.no].x) / 2.0, left + here.width / 2.0);
    }
    right = std::max(right, here.x + here.width / 2.0 + kGap);
  }

  [[nodiscard]] double y_of(const DrawnNode& node) const {
    return top_ + kTitle + node.depth * kLevel;
  }

  void text(double x, double y, const std::string& words, const std::string& kind) {
    body_ += "<text class=\"" + kind + "\" x=\"" + svg_number(x) + "\" y=\"" + svg_number(y) +
             "\">" + svg_text(words) + "</text>\n";
  }

  void branches(const DrawnTree& tree, std::size_t i, const std::vector<Placed>& placed) {
    const DrawnNode& node = tree.nodes[i];
    for (const int child : {node.yes, node.no}) {
      if (child < 0) continue;
      const double from = y_of(node) + kBoxHeight;
      const double to = y_of(tree.nodes[child]);
      body_ += "<line x1=\"" + svg_number(placed[i].x) + "\" y1=\"" + svg_number(from) +
               "\" x2=\"" + svg_number(placed[child].x) + "\" y2=\"" + svg_number(to) + "\"/>\n";
      const bool yes = child == node.yes;
      text(0.35 * placed[i].x + 0.65 * placed[child].x + (yes ? -16.0 : 14.0),
           0.35 * from + 0.65 * to - 4.0, yes ? "yes" : "no", "answer");
    }
  }

  void box(const DrawnNode& node, const Placed& place) {
    const double y = y_of(node);
    body_ += "<rect class=\"" + std::string(node.yes < 0 ? "leaf" : "ask") + "\" x=\"" +
             svg_number(place.x - place.width / 2.0) + "\" y=\"" + svg_number(y) + "\" width=\"" +
             svg_number(place.width) + "\" height=\"" + svg_number(kBoxHeight) + "\" rx=\"5\"/>\n";
    text(place.x, y + 17.0, node.words, "words");
    text(place.x, y + 33.0, node.reach, "reach");
  }

  std::string body_;
  double top_ = kMargin, width_ = 0.0;
};

}  // namespace

std::string trees_svg(const GestureModel& model, const TreeChoice& choice) {
  Picture picture;
  for (const DrawnTree& tree : draw_trees(model, choice)) picture.add(tree);
  return picture.svg();
}

}  // namespace posed::gesture
