#include "daemon/publish/event_text.hpp"

#include <spdlog/fmt/fmt.h>

#include "posed/v1/posed.pb.h"
#include "proto/text/clean.hpp"

namespace posed::publish {
namespace {

using pipeline::Change;
using pipeline::StreamEvent;

std::string words(const pipeline::ShortText& text) {
  return clean(text.text()) + (text.cut() ? "..." : "");
}

// "march.style -> sway.style"; only the new name if there was no old one.
std::string from_to(const StreamEvent& event) {
  const std::string before = words(event.before);
  return (before.empty() ? "" : before + " -> ") + words(event.after);
}

std::string changed(const StreamEvent& event) {
  switch (event.change) {
    case Change::kAlpha:
      return fmt::format("alpha {:.2f} -> {:.2f} from frame {}", event.alpha_before, event.value,
                         event.sequence);
    case Change::kStyleModel:
      return fmt::format("style model {} from frame {}", from_to(event), event.sequence);
    case Change::kGestureModel:
      return fmt::format("gesture model {} from frame {}", from_to(event), event.sequence);
    case Change::kStopPlaying:
      return fmt::format("stops performing at frame {}", event.sequence);
  }
  return {};
}

}  // namespace

std::string sentence(const StreamEvent& event) {
  switch (event.kind) {
    case v1::Event::KIND_STARTED:
      return "the first data came";
    case v1::Event::KIND_STALE:
      return fmt::format("nothing came for {:.2f} s", event.value);
    case v1::Event::KIND_RECOVERED:
      return "data comes again";
    case v1::Event::KIND_ENDED:
      return fmt::format("the source has ended after {} frames", event.sequence);
    case v1::Event::KIND_CONTROL:
      return changed(event);
    case v1::Event::KIND_CALIBRATED: {
      const std::string name = words(event.after);
      return fmt::format("calibration {}from frame {}", name.empty() ? name : name + " ",
                         event.sequence + 1);
    }
    case v1::Event::KIND_CLOCK_JUMPED:
      return "the device's own time jumped (did it restart?); it is mapped to the host's time "
             "again";
    case v1::Event::KIND_PLAYING:
      return fmt::format("performs {:.0f} label{} ({}) from frame {} on, or after those that wait",
                         event.value, event.value == 1.0 ? "" : "s", words(event.after),
                         event.sequence);
    case v1::Event::KIND_PLAYED:
      return "all labels are performed";
    default:
      return {};
  }
}

std::string sentence(const ShedTally::Sum& shed) {
  const std::string which = shed.frames == 1 ? fmt::format("frame {} was", shed.first)
                                             : fmt::format("{} frames, {} to {}, were", shed.frames,
                                                           shed.first, shed.last);
  return which + " skipped: newer ones waited";
}

}  // namespace posed::publish
