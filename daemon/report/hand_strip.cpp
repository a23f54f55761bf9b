#include <utility>

#include "daemon/report/gesture_sections.hpp"

namespace posed::report {
namespace {

constexpr double kHandRow_px = 110.0;

}  // namespace

Figure hand_strip(const std::string& title, const std::string& sentence,
                  const std::vector<picture::StripRow>& rows, const picture::Camera& camera) {
  const auto layout = picture::layout_of(rows, camera, kHandRow_px, false);
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
