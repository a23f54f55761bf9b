#include "daemon/tools/gesture/gesture_report.hpp"

#include <nlohmann/json.hpp>

#include "daemon/tools/command/json_numbers.hpp"
#include "daemon/tools/gesture/gesture_figures.hpp"
#include "daemon/tools/gesture/gesture_measures.hpp"

namespace posed::tools {
namespace {

void add_comparison(const GestureReport& report, const GestureFigures& figures,
                    const gesture::GestureModel& model,
                    const std::vector<gesture::Recording>& recordings, report::Page& page) {
  if (recordings.empty()) return;
  page.section("Beside " + report.recorded_by);
  if (const auto over = figures.over(recordings.front())) page.add(*over);
  if (const auto unseen = figures.unseen(all_poses(recordings), report.recorded_by)) {
    page.add(*unseen);
  }
  if (const auto confusion = confusion_of(model, report.body, recordings, report.recorded_by)) {
    page.add(*confusion);
  }
}

}  // namespace

Result<> write_gesture_report(const GestureReport& report,
                              const std::shared_ptr<const gesture::GestureModel>& model,
                              const std::vector<gesture::Recording>& recordings,
                              const nlohmann::json& figures, const std::filesystem::path& path) {
  std::optional<perform::BodyFigure> body;
  if (!model->is_hand()) {
    auto figure = perform::BodyFigure::of(*model, report.body);
    if (!figure) return std::unexpected(figure.error());
    body = std::move(*figure);
  }
  const GestureFigures drawn(model, report.labels, std::move(body));
  report::Page page(report.title, report.command);
  page.verdict(figures["verdict"].get<std::string>(), report.good);
  if (figures.contains("warnings")) {
    page.warnings(figures["warnings"].get<std::vector<std::string>>());
  }
  page.section("What it performs");
  page.add(drawn.strip());
  page.add(drawn.trajectories());
  add_comparison(report, drawn, *model, recordings, page);
  page.section("How it is made");
  page.add(drawn.lag(report.curve.empty() ? drawn.curve() : report.curve));
  page.add(drawn.durations());
  for (const report::Figure& tree : drawn.trees()) page.add(tree);
  page.section("Numbers");
  page.add(report::all_numbers("Every number", "Counts and measures, by their names.",
                               numbers_of(figures)));
  add_json(figures, page);
  return report::write_page(page, path);
}

}  // namespace posed::tools
