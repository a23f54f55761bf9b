#include <algorithm>

#include <spdlog/fmt/fmt.h>

#include "daemon/tools/report/bars.hpp"
#include "daemon/tools/report/style_sections.hpp"

namespace posed::report {

Figure stride_scores(const std::vector<ClipStride>& clips, double warn, double refuse) {
  constexpr std::size_t kMostClips = 40;
  std::vector<ClipStride> worst = clips;
  std::ranges::stable_sort(worst, std::ranges::greater{}, &ClipStride::score);
  if (worst.size() > kMostClips) worst.resize(kMostClips);
  Bars bars{.quantity = "stride score: share of the legs' motion that fits no stride",
            .unit = "1",
            .series = {"score"},
            .groups = {},
            .rules = {{warn, "uneven: warns"}, {refuse, "no walk: refuses"}},
            .logarithmic = false,
            .digits = 3};
  Table table{.columns = {{"clip", false},
                          {"group", false},
                          {"frames"},
                          {"stride [s]"},
                          {"stride score [1]"},
                          {"from its own cycle, rms [deg]"}},
              .rows = {}};
  for (const ClipStride& clip : worst) {
    bars.groups.push_back({clip.clip, {clip.score}});
    table.rows.push_back({clip.clip, clip.group, std::to_string(clip.frames),
                          number_text(clip.period_s, 2), number_text(clip.score, 3),
                          number_text(clip.residual_deg, 1)});
  }
  std::string sentence =
      "Short bars are steady walks; a bar beyond the first line has uneven strides, one beyond the "
      "second is no walk at all, and its phases are a guess.";
  if (clips.size() > worst.size()) {
    sentence += fmt::format(" Shown are the {} worst of {}.", worst.size(), clips.size());
  }
  return {.title = "Strides of the clips",
          .sentence = std::move(sentence),
          .drawings = {draw_bars(bars)},
          .tables = {std::move(table)}};
}

}  // namespace posed::report
