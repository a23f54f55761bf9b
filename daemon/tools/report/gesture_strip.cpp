#include <utility>

#include "daemon/tools/report/gesture_sections.hpp"

namespace posed::report {
namespace {

constexpr double kHandRow_px = 110.0, kBodyRow_px = 170.0;

}  // namespace

Figure gesture_strip(const std::string& title, const std::string& sentence,
                     const std::vector<picture::StripRow>& rows, const picture::Camera& camera,
                     bool ground) {
  const auto layout = picture::layout_of(rows, camera, ground ? kBodyRow_px : kHandRow_px, ground);
  auto strip = picture::draw_strip(rows, camera, layout, {.title = "", .sentence = ""});
  return {.title = title,
          .sentence = sentence,
          .drawings = {{.width_px = strip.width_px,
                        .height_px = strip.height_px,
                        .elements = std::move(strip.elements),
                        .kind = "strip"}},
          .tables = {}};
}

}  // namespace posed::report
