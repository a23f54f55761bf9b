#include "daemon/tools/gesture/auto_label.hpp"

#include <cstdio>

#include <nlohmann/json.hpp>

#include "daemon/tools/command/command.hpp"
#include "daemon/tools/command/waiting.hpp"
#include "daemon/tools/gesture/gesture_data.hpp"
#include "models/gesture/auto_label.hpp"
#include "models/gesture/movement_label.hpp"
#include "proto/clip/label_file.hpp"
#include "proto/text/json_text.hpp"

namespace posed::tools {

int auto_label(const AutoLabelOptions& options) {
  const bool one_movement = !options.movement.empty();
  const auto recording =
      one_movement ? load_unlabelled(options.clip, options.body, options.rate_hz, options.read)
                   : load_recording(options.clip, options.examples, options.rate_hz, options.read);
  if (!recording) return report(recording.error());
  const auto proposed = [&] {
    const Waiting waiting("proposing labels");
    if (!one_movement) return gesture::propose_segments(*recording);
    const auto hold = options.cycles ? gesture::Hold::kCycles : gesture::Hold::kWhole;
    return gesture::propose_movement(*recording, options.movement, options.rest, hold);
  }();
  if (!proposed) return report(proposed.error());
  std::vector<clip::LabelSegment> labels;
  for (const gesture::Segment& segment : *proposed) {
    labels.push_back({segment.begin / options.rate_hz, segment.end / options.rate_hz, segment.label,
                      static_cast<int>(labels.size()) + 1});
  }
  if (auto written = clip::write_labels(labels, options.out); !written) {
    return report(written.error());
  }
  const std::size_t examples = recording->segments.size();
  if (options.json) {
    const nlohmann::json counts{
        {"examples", examples}, {"segments", labels.size()}, {"out", options.out.string()}};
    std::printf("%s\n", json_text(counts, 2).c_str());
  } else if (one_movement) {
    std::printf("%zu segments proposed, written to %s; look through them\n", labels.size(),
                options.out.c_str());
  } else {
    std::printf(
        "%zu segments proposed from %zu examples, written to %s; look through them, two "
        "gestures of one name in a row look like one\n",
        labels.size(), examples, options.out.c_str());
  }
  return 0;
}

}  // namespace posed::tools
