#include <algorithm>

#include <spdlog/fmt/fmt.h>

#include "daemon/tools/report/gesture_sections.hpp"
#include "daemon/tools/report/look.hpp"
#include "proto/text/clean.hpp"

namespace posed::report {
namespace {

constexpr double kCell_px = 54.0, kCellHeight_px = 34.0, kConfusionLeft_px = 190.0;
constexpr double kConfusionTop_px = 48.0;
constexpr const char* kColumns = "recognised label [% of the frames]";
constexpr double kDeepest = 0.6;  // opacity of a full cell, on which text can still be read

std::string cell_at(double x, double y, double share, bool agrees) {
  std::string out = fmt::format("<rect class=\"cell {} fill\"{}{}{}{} fill-opacity=\"{:.3f}\"/>\n",
                                agrees ? "s0" : "s1", attribute("x", x), attribute("y", y),
                                attribute("width", kCell_px), attribute("height", kCellHeight_px),
                                kDeepest * share);
  if (share < 0.0005) return out;
  return out +
         fmt::format("<text class=\"mid\"{}{}>{}</text>\n", attribute("x", x + kCell_px / 2.0),
                     attribute("y", y + kCellHeight_px / 2.0 + 4.0), number_text(100.0 * share, 1));
}

}  // namespace

Figure label_confusion(const Confusion& confusion) {
  std::string out = fmt::format(
      "<text class=\"quiet\"{} y=\"16\">{}</text>\n"
      "<text class=\"quiet end\"{}{}>given label</text>\n",
      attribute("x", kConfusionLeft_px), kColumns, attribute("x", kConfusionLeft_px - 10.0),
      attribute("y", kConfusionTop_px - 10.0));
  for (std::size_t c = 0; c < confusion.labels.size(); ++c) {
    out += fmt::format(
        "<text class=\"mid head\"{}{}>{}</text>\n",
        attribute("x", kConfusionLeft_px + kCell_px * (static_cast<double>(c) + 0.5)),
        attribute("y", kConfusionTop_px - 10.0), escaped(clean_name(confusion.labels[c])));
  }
  for (std::size_t r = 0; r < confusion.given.size(); ++r) {
    const double y = kConfusionTop_px + kCellHeight_px * static_cast<double>(r);
    out += fmt::format("<text class=\"end\"{}{}>{} ({} frames)</text>\n",
                       attribute("x", kConfusionLeft_px - 10.0), attribute("y", y + 21.0),
                       escaped(clean_name(confusion.given[r])), confusion.frames[r]);
    for (std::size_t c = 0; c < confusion.labels.size(); ++c) {
      out += cell_at(kConfusionLeft_px + kCell_px * static_cast<double>(c), y,
                     confusion.share[r][c], confusion.labels[c] == confusion.given[r]);
    }
  }
  const double columns_px = kCell_px * static_cast<double>(confusion.labels.size());
  const auto rows = static_cast<double>(confusion.given.size());
  return {
      .title = "Which gesture is recognised",
      .sentence =
          "Blue cells are right, orange ones are mistaken for another gesture, as is to "
          "be expected near the border between two. Measured on " +
          confusion.measured_on + ", frame by frame, as the live stage does.",
      .drawings = {{.width_px = kConfusionLeft_px + std::max(columns_px, text_px(kColumns)) + 8.0,
                    .height_px = kConfusionTop_px + kCellHeight_px * rows + 8.0,
                    .elements = std::move(out)}},
      .tables = {}};
}

}  // namespace posed::report
