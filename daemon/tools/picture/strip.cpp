#include "daemon/tools/picture/strip.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numeric>
#include <utility>

#include "proto/text/svg.hpp"

namespace posed::picture {
namespace {

constexpr double kMargin_px = 16.0, kGap_px = 14.0, kTitle_px = 26.0, kRowTitle_px = 20.0;
constexpr double kCaption_px = 22.0, kLetter_px = 7.0;
constexpr double kTick_m = 0.5, kTick_px = 5.0;
constexpr double kOutline_px = 2.0;  // white, so that crossing limbs can be told apart
constexpr std::string_view kPale = "#b0b0b0";
constexpr std::string_view kStyle =
    "text{font:13px sans-serif;text-anchor:middle;fill:#222}.title{font:bold 15px sans-serif;"
    "text-anchor:start}.row{text-anchor:start}.see{text-anchor:start;fill:#555}"
    "line{stroke-linecap:round}.ground{stroke:#999;stroke-linecap:butt}";

struct Point {
  double x = 0.0, y = 0.0;  // px
};

std::string line(Point from, Point to, std::string_view rest) {
  return "<line" + svg_attribute("x1", from.x) + svg_attribute("y1", from.y) +
         svg_attribute("x2", to.x) + svg_attribute("y2", to.y) + std::string(rest) + "/>\n";
}

std::string stroke(std::string_view colour, double width_px) {
  return " stroke=\"" + std::string(colour) + "\"" + svg_attribute("stroke-width", width_px);
}

std::string words(Point at, std::string_view kind, std::string_view text) {
  if (text.empty()) return {};
  return "<text class=\"" + std::string(kind) + "\"" + svg_attribute("x", at.x) +
         svg_attribute("y", at.y) + ">" + svg_text(text) + "</text>\n";
}

// Draws one pose into its column of the picture.
class PoseDrawing {
 public:
  // `root`: where the place below the figure's root is in the picture.
  PoseDrawing(const Camera& camera, const StripLayout& layout, Point root, const Figure& figure)
      : camera_(camera), layout_(layout), root_(root), place_(camera.see(figure.place_m)) {}

  // Far limbs first, so that near ones cover them.
  [[nodiscard]] std::string figure(const Figure& figure, bool pale) const {
    std::vector<std::size_t> order(figure.sticks.size());
    std::iota(order.begin(), order.end(), 0);
    std::ranges::stable_sort(order, {}, [&](std::size_t i) {
      const Stick& stick = figure.sticks[i];
      return camera_.see(stick.from_m).near_m + camera_.see(stick.to_m).near_m;
    });
    std::string out;
    for (const std::size_t i : order) {
      const Stick& stick = figure.sticks[i];
      const double width_px = std::max(1.0, stick.width_m * layout_.px_per_m);
      const Point from = at(stick.from_m);
      const Point to = at(stick.to_m);
      out += line(from, to, stroke("#fff", width_px + kOutline_px));
      out += line(from, to, stroke(pale ? kPale : stick.colour, width_px));
    }
    if (figure.head) {
      const Point centre = at(figure.head->centre_m);
      out += "<circle" + svg_attribute("cx", centre.x) + svg_attribute("cy", centre.y) +
             svg_attribute("r", figure.head->radius_m * layout_.px_per_m) + " fill=\"" +
             std::string(pale ? kPale : "#4d4d4d") + "\" stroke=\"#fff\"/>\n";
    }
    return out;
  }

  // The marks of the ground stand still in the world, so they show how the figure travels.
  [[nodiscard]] std::string ground(double left_px, double right_px) const {
    const double y = root_.y - layout_.bottom_m * layout_.px_per_m;
    std::string out = line({left_px, y}, {right_px, y}, " class=\"ground\"");
    const double first_m = place_.right_m + (left_px - root_.x) / layout_.px_per_m;
    const double last_m = place_.right_m + (right_px - root_.x) / layout_.px_per_m;
    for (double k = std::ceil(first_m / kTick_m); k * kTick_m < last_m; ++k) {
      const double x = root_.x + (k * kTick_m - place_.right_m) * layout_.px_per_m;
      out += line({x, y}, {x, y + kTick_px}, " class=\"ground\"");
    }
    return out;
  }

 private:
  [[nodiscard]] Point at(const Eigen::Vector3d& world_m) const {
    const Seen seen = camera_.see(world_m);
    return {.x = root_.x + (seen.right_m - place_.right_m) * layout_.px_per_m,
            .y = root_.y - (seen.up_m - place_.up_m) * layout_.px_per_m};
  }

  const Camera& camera_;
  const StripLayout& layout_;
  Point root_;
  Seen place_;
};

// Widens the layout by a ball around a point.
void include(const Seen& seen, const Seen& place, double radius_m, StripLayout& layout) {
  const double right_m = seen.right_m - place.right_m;
  const double up_m = seen.up_m - place.up_m;
  layout.left_m = std::min(layout.left_m, right_m - radius_m);
  layout.right_m = std::max(layout.right_m, right_m + radius_m);
  layout.bottom_m = std::min(layout.bottom_m, up_m - radius_m);
  layout.top_m = std::max(layout.top_m, up_m + radius_m);
}

}  // namespace

StripLayout layout_of(const std::vector<StripRow>& rows, const Camera& camera, double height_px,
                      bool ground) {
  StripLayout layout{.bottom_m = std::numeric_limits<double>::infinity(),
                     .top_m = -std::numeric_limits<double>::infinity(),
                     .ground = ground};
  for (const StripRow& row : rows) {
    for (const auto& [figure, caption] : row.poses) {
      const Seen place = camera.see(figure.place_m);
      for (const Stick& stick : figure.sticks) {
        include(camera.see(stick.from_m), place, stick.width_m / 2.0, layout);
        include(camera.see(stick.to_m), place, stick.width_m / 2.0, layout);
      }
      if (figure.head) {
        include(camera.see(figure.head->centre_m), place, figure.head->radius_m, layout);
      }
    }
  }
  layout.px_per_m = height_px / std::max(layout.top_m - layout.bottom_m, 1e-6);
  return layout;
}

StripDrawing draw_strip(const std::vector<StripRow>& rows, const Camera& camera,
                        const StripLayout& layout, const StripText& text) {
  const double height_px = (layout.top_m - layout.bottom_m) * layout.px_per_m;
  const double column_px = (layout.right_m - layout.left_m) * layout.px_per_m + kGap_px;
  std::size_t columns = 0;
  std::string body = words({kMargin_px, kMargin_px + 14.0}, "title", text.title);
  double y = kMargin_px + (text.title.empty() ? 0.0 : kTitle_px);
  for (const StripRow& row : rows) {
    body += words({kMargin_px, y + 14.0}, "row", row.title);
    if (!row.title.empty()) y += kRowTitle_px;
    double left = kMargin_px;
    for (const auto& [figure, caption] : row.poses) {
      const Point root{.x = left + kGap_px / 2.0 - layout.left_m * layout.px_per_m,
                       .y = y + layout.top_m * layout.px_per_m};
      const PoseDrawing drawing(camera, layout, root, figure);
      if (layout.ground) body += drawing.ground(left, left + column_px);
      body += drawing.figure(figure, row.pale);
      body += words({left + column_px / 2.0, y + height_px + kCaption_px - 4.0}, "time", caption);
      left += column_px;
    }
    columns = std::max(columns, row.poses.size());
    y += height_px + kCaption_px + kGap_px;
  }
  body += words({kMargin_px, y + 8.0}, "see", text.sentence);
  const double words_px =
      static_cast<double>(std::max(text.sentence.size(), text.title.size())) * kLetter_px;
  const double width_px =
      2.0 * kMargin_px + std::max(static_cast<double>(columns) * column_px, words_px);
  const double below_px = text.sentence.empty() ? 0.0 : kTitle_px;
  return {.width_px = width_px, .height_px = y + below_px, .elements = std::move(body)};
}

std::string strip_svg(const std::vector<StripRow>& rows, const Camera& camera,
                      const StripLayout& layout, const StripText& text) {
  const StripDrawing drawing = draw_strip(rows, camera, layout, text);
  return svg_document(drawing.width_px, drawing.height_px, kStyle, drawing.elements);
}

}  // namespace posed::picture
