#include "daemon/control/trigger.hpp"

#include <algorithm>
#include <array>
#include <pugixml.hpp>
#include <utility>

#include <spdlog/spdlog.h>

#include "daemon/pipeline/take.hpp"
#include "proto/frame/timecode.hpp"
#include "proto/text/clean.hpp"

namespace posed::control {
namespace {

constexpr std::size_t kMaxDigits = 19;  // of a PacketID
constexpr std::string_view kWhite = " \t\r\n";

// Between the white space and zeros that senders put around their message.
std::string_view trimmed(std::string_view text) {
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
  const auto first = text.find_first_not_of(kWhite);
  if (first == std::string_view::npos) return {};
  const auto last = text.find_last_not_of(std::string_view(" \t\r\n\0", 5));
  return text.substr(first, last < first ? 0 : last - first + 1);
}

// The only element of the document, which has nothing else.
Result<pugi::xml_node> only_root(const pugi::xml_document& document) {
  pugi::xml_node root;
  for (const pugi::xml_node& node : document.children()) {
    if (node.type() == pugi::node_declaration && !root) continue;
    if (node.type() != pugi::node_element || root) {
      return fail("it has something beside its one element");
    }
    root = node;
  }
  if (!root) return fail("it is not XML: it has no element");
  return root;
}

Result<> read_children(const pugi::xml_node& root, TriggerMessage& message) {
  std::string timecode;
  const std::array<std::pair<const char*, std::string*>, 7> wanted{
      {{"Name", &message.name},
       {"Notes", &message.notes},
       {"Description", &message.description},
       {"SessionName", &message.session},
       {"Delay", &message.delay},
       {"PacketID", &message.packet_id},
       {"TimeCode", &timecode}}};
  for (const auto& [name, value] : wanted) {
    const pugi::xml_node child = root.child(name);
    if (child.next_sibling(name)) return fail("it has two elements " + std::string(name));
    *value = child.attribute("VALUE").value();
  }
  message.timecode = view_of(to_timecode(timecode));
  return {};
}

// A cut or escaped name is better than no take.
std::string printable_name(const std::string& name) {
  constexpr std::size_t kMark = 3;  // "..." where it was cut
  return clean(name, pipeline::kMaxTakeName - kMark);
}

// What the sender says beside name and time.
std::string remark_of(const TriggerMessage& message, const std::string& sender) {
  std::string remark = "triggered by " + sender;
  const auto add = [&](const char* what, const std::string& value) {
    if (!value.empty()) remark += std::string(", ") + what + " " + in_quotes(value);
  };
  add("session", message.session);
  add("description", message.description);
  add("notes", message.notes);
  if (!message.start && message.result != "SUCCESS") add("result", message.result);
  if (!message.delay.empty() && message.delay != "0") {
    remark += ", its delay " + in_quotes(message.delay) + " (ms) is not waited for";
  }
  return remark;
}

}  // namespace

Result<TriggerMessage> parse_trigger(std::string_view datagram) {
  if (datagram.size() > kMaxTrigger) return fail("it has more than 8 KB");
  const std::string_view text = trimmed(datagram);
  if (text.find('\0') != std::string_view::npos) return fail("it has a zero in its text");
  if (text.find("<!") != std::string_view::npos) {
    return fail("it has a document type, an entity or a comment, which posed does not read");
  }
  pugi::xml_document document;
  // A fragment shows text beside the element, which is skipped in a document.
  constexpr unsigned kOptions =
      pugi::parse_default | pugi::parse_pi | pugi::parse_declaration | pugi::parse_fragment;
  const pugi::xml_parse_result parsed =
      document.load_buffer(text.data(), text.size(), kOptions, pugi::encoding_utf8);
  if (!parsed) {
    return fail("it is not XML from byte " + std::to_string(parsed.offset) + " on (" +
                parsed.description() + ")");
  }
  const auto root = TRY(only_root(document));
  const std::string_view kind = root.name();
  if (kind != "CaptureStart" && kind != "CaptureStop") {
    return fail("its element is " + in_quotes(kind) + " instead of CaptureStart or CaptureStop");
  }
  TriggerMessage message{.start = kind == "CaptureStart"};
  TRY(read_children(root, message));
  message.result = root.attribute("RESULT").value();
  const auto is_digit = [](char c) { return c >= '0' && c <= '9'; };
  if (message.packet_id.size() > kMaxDigits || !std::ranges::all_of(message.packet_id, is_digit)) {
    return fail("its PacketID " + in_quotes(message.packet_id) + " is not a number");
  }
  return message;
}

bool Trigger::is_repeated(const TriggerMessage& message, const std::string& sender) {
  if (message.packet_id.empty()) return false;
  std::string command = sender + (message.start ? " start " : " stop ") + message.packet_id;
  const bool again = command == last_;
  last_ = std::move(command);
  return again;
}

bool Trigger::comes_too_fast() {
  const std::int64_t now_ns = clock_();
  if (allowed_ns_ == kNoTime_ns) allowed_ns_ = now_ns;
  allowed_ns_ = std::max(allowed_ns_, now_ns);
  if (allowed_ns_ - now_ns > (kAtOnce - 1) * kStartEvery_ns) return true;
  allowed_ns_ += kStartEvery_ns;
  return false;
}

void Trigger::handle(std::string_view datagram, const std::string& sender) {
  const auto message = parse_trigger(datagram);
  if (!message) {
    ++refused_;
    spdlog::warn("trigger: a datagram from {} is refused: {} ({} so far)", sender,
                 message.error().text(), refused_);
    return;
  }
  if (is_repeated(*message, sender)) {
    ++repeated_;
    return;
  }
  if (message->start && comes_too_fast()) {
    ++refused_;
    spdlog::warn(
        "trigger: a take of {} is refused: takes begin too fast; name the capture system in"
        " [trigger] peers ({} so far)",
        sender, refused_);
    return;
  }
  pipeline::TakeMark mark{.start = message->start,
                          .time_ns = clock_(),
                          .timecode = message->timecode,
                          .remark = remark_of(*message, sender)};
  if (mark.start) mark.name = printable_name(message->name);
  if (auto marked = daemon_control_.mark_take(mark); !marked) {
    ++refused_;
    spdlog::warn("trigger: what {} asked for cannot be done: {} ({} so far)", sender,
                 marked.error().text(), refused_);
    return;
  }
  ++marked_;
}

}  // namespace posed::control
