#include "daemon/publish/notice_text.hpp"

#include <spdlog/fmt/fmt.h>

#include "posed/v1/posed.pb.h"
#include "proto/text/clean.hpp"

namespace posed::publish {
namespace {

using pipeline::Change;
using pipeline::Notice;

std::string words(const pipeline::ShortText& text) {
  return clean(text.text()) + (text.cut() ? "..." : "");
}

// "march.style -> sway.style"; only the new one where there was none.
std::string from_to(const Notice& notice) {
  const std::string before = words(notice.before);
  return (before.empty() ? "" : before + " -> ") + words(notice.after);
}

std::string changed(const Notice& notice) {
  switch (notice.change) {
    case Change::kAlpha:
      return fmt::format("alpha {:.2f} -> {:.2f} from frame {}", notice.alpha_before, notice.value,
                         notice.sequence);
    case Change::kStyleModel:
      return fmt::format("style model {} from frame {}", from_to(notice), notice.sequence);
    case Change::kGestureModel:
      return fmt::format("gesture model {} from frame {}", from_to(notice), notice.sequence);
    case Change::kStopPlaying:
      return fmt::format("stops performing at frame {}", notice.sequence);
  }
  return {};
}

}  // namespace

std::string sentence(const Notice& notice) {
  switch (notice.event) {
    case v1::Event::KIND_STARTED:
      return "the first data came";
    case v1::Event::KIND_STALE:
      return fmt::format("nothing came for {:.2f} s", notice.value);
    case v1::Event::KIND_RECOVERED:
      return "data comes again";
    case v1::Event::KIND_ENDED:
      return fmt::format("the source has ended after {} frames", notice.sequence);
    case v1::Event::KIND_CONTROL:
      return changed(notice);
    case v1::Event::KIND_CALIBRATED: {
      const std::string name = words(notice.after);
      return fmt::format("calibration {}from frame {}", name.empty() ? name : name + " ",
                         notice.sequence + 1);
    }
    case v1::Event::KIND_CLOCK_JUMPED:
      return "the device's own time jumped (did it restart?); it is mapped to the host's anew";
    case v1::Event::KIND_PLAYING:
      return fmt::format("performs {:.0f} label{} ({}) from frame {} on, or after those that wait",
                         notice.value, notice.value == 1.0 ? "" : "s", words(notice.after),
                         notice.sequence);
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
