#include "daemon/tools/report/style_sections.hpp"

namespace posed::report {
namespace {

constexpr double kPoseRow_px = 190.0;

}  // namespace

Figure cycle_strips(const CycleRows& cycles) {
  Figure figure{.title = cycles.title, .sentence = cycles.sentence, .drawings = {}, .tables = {}};
  for (const CycleRows::Seen& view : cycles.views) {
    const auto layout = picture::layout_of(cycles.rows, view.camera, kPoseRow_px, true);
    auto strip = picture::draw_strip(cycles.rows, view.camera, layout,
                                     {.title = "Seen " + view.from, .sentence = ""});
    figure.drawings.push_back({.width_px = strip.width_px,
                               .height_px = strip.height_px,
                               .elements = std::move(strip.elements),
                               .kind = "strip"});
  }
  return figure;
}

}  // namespace posed::report
