#include "daemon/publish/event_text.hpp"

#include <spdlog/fmt/fmt.h>

#include "proto/text/clean.hpp"

namespace posed::publish {
namespace {

using pipeline::StageChange;
using pipeline::StreamEvent;

std::string words(const ShortText& text) { return clean(text.text()) + (text.cut() ? "..." : ""); }

// "march.style -> sway.style"; only the new name if there was no old one; "none" for no model.
std::string from_to(const StreamEvent& event) {
  const std::string before = words(event.before);
  const std::string after = words(event.after);
  return (before.empty() ? "" : before + " -> ") + (after.empty() ? "none" : after);
}

std::string changed(const StreamEvent& event) {
  const StageChange& change = event.change;
  if (change.type == nullptr) return {};
  switch (change.kind) {
    case StageChange::Kind::kSet: {
      const ParameterSpec& spec = change.type->parameters[change.index];
      return fmt::format("{}.{} {} -> {} from frame {}", change.type->name, spec.shown_name(),
                         display_text(spec, event.value_before), display_text(spec, change.value),
                         event.sequence);
    }
    case StageChange::Kind::kModel:
      return fmt::format("{} model {} from frame {}", change.type->name, from_to(event),
                         event.sequence);
    case StageChange::Kind::kCommand: {
      const std::string what = words(event.after);
      return fmt::format("{}{} at frame {}", change.type->commands[change.index].name,
                         what.empty() ? "" : " " + what, event.sequence);
    }
  }
  return {};
}

}  // namespace

std::string sentence(const StreamEvent& event) {
  if (!event.notice.empty()) return std::string(event.notice);
  switch (event.kind) {
    case v1::Event::KIND_STARTED:
      return "the first data came";
    case v1::Event::KIND_STALE:
      return fmt::format("nothing came for {:.2f} s", event.value);
    case v1::Event::KIND_RECOVERED:
      return "data comes again";
    case v1::Event::KIND_ENDED:
      if (!event.leaves) return fmt::format("the source has ended after {} frames", event.sequence);
      return fmt::format("its stages are made again after frame {}, for another stream",
                         event.sequence);
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
      return fmt::format("plays {} from frame {} on, or after what still waits", words(event.after),
                         event.sequence);
    case v1::Event::KIND_PLAYED:
      return "has played all of its labels";
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

std::string body_words(const std::string& source, const std::string& body) {
  return fmt::format("body {} of source {}", in_quotes(body), source);
}

std::string has_left(const std::string& source, const std::string& body, std::uint64_t last_frame) {
  return fmt::format("{} has left after frame {}", body_words(source, body), last_frame);
}

v1::Event event_message(const std::string& stream, v1::Event::Kind kind, std::int64_t time_ns,
                        std::uint64_t sequence, const std::string& text) {
  v1::Event event;
  event.set_stream(stream);
  event.set_kind(kind);
  event.set_time_ns(time_ns);
  event.set_sequence(sequence);
  event.set_text(clean(text));
  return event;
}

}  // namespace posed::publish
