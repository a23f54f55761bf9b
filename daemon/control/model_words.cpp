#include "daemon/control/model_words.hpp"

#include <set>
#include <span>
#include <utility>

#include <spdlog/fmt/fmt.h>
#include <nlohmann/json.hpp>

#include "models/gesture/model_file.hpp"
#include "models/style/model/model_strip.hpp"
#include "models/style/model/style_model.hpp"
#include "proto/text/clean.hpp"
#include "proto/text/json_text.hpp"
#include "proto/text/list.hpp"

namespace posed::control {
namespace {

using nlohmann::json;

constexpr std::size_t kMaxSentence = 400;  // bytes of a sentence

std::string text_of(const json& object, const char* key) {
  const auto found = object.find(key);
  return found != object.end() && found->is_string() ? found->get<std::string>() : std::string();
}

// The report is for people and comes from a file: what it lacks is left out.
json report_of(const std::string& text) {
  json report = parse_json(text);
  return report.is_object() ? report : json::object();
}

std::string some(std::size_t count, std::string_view one, std::string_view many) {
  return fmt::format("{} {}", count, count == 1 ? one : many);
}

// "12 clips of 6 people on 2 days"
std::string sources_of(const json& report) {
  std::set<std::string> people;
  std::set<std::string> days;
  std::size_t clips = 0;
  const auto list = report.find("clips");
  if (list == report.end() || !list->is_array()) return {};
  for (const json& clip : *list) {
    if (!clip.is_object()) continue;
    ++clips;
    people.insert(text_of(clip, "subject"));
    if (const auto day = text_of(clip, "day"); !day.empty()) days.insert(day);
  }
  const std::string who = people.size() == 1 && !people.begin()->empty()
                              ? *people.begin()
                              : some(people.size(), "person", "people");
  std::string words = some(clips, "clip", "clips") + " of " + who;
  if (days.size() == 1) words += " on day " + *days.begin();
  if (days.size() > 1) words += fmt::format(" on {} days", days.size());
  return words;
}

ModelWords words_of_style(const style::StyleModel& model,
                          std::span<const std::shared_ptr<const Skeleton>> known) {
  const json report = report_of(model.report_json);
  ModelWords words;
  words.learnt = "turns " + model.from + " into " + joined(model.names());
  if (const auto sources = sources_of(report); !sources.empty())
    words.learnt += ", from " + sources;
  words.skeleton = model.space.space == motion::Space::kHumanoid
                       ? "any person's"
                       : fmt::format("its own: {} joints from {} on", model.space.joints.size(),
                                     model.space.joints.empty() ? "" : model.space.joints.front());
  words.verdict = text_of(report, "verdict");
  words.strip = style::strip_of(model, known);
  return words;
}

ModelWords words_of_gesture(const gesture::GestureModel& model) {
  const json report = report_of(model.report_json);
  ModelWords words;
  std::vector<std::string> labels;
  const auto known = report.find("labels");
  if (known != report.end() && known->is_array()) {
    for (const json& label : *known) {
      if (label.is_object()) labels.push_back(text_of(label, "name"));
    }
  }
  words.learnt = "gestures " + joined(labels, " ");
  const auto count = report.find("gestures");
  if (count != report.end() && count->is_number_unsigned()) {
    words.learnt +=
        ", from " + some(count->get<std::size_t>(), "recorded gesture", "recorded gestures");
  }
  words.verdict = text_of(report, "verdict");
  return words;
}

}  // namespace

ModelWords words_of_model(std::string_view bytes, std::string_view kind, const std::string& name,
                          std::span<const std::shared_ptr<const Skeleton>> known) {
  const auto data = std::as_bytes(std::span(bytes));
  ModelWords words;
  if (kind == "style") {
    const auto model = style::parse_model(data, name);
    words = model ? words_of_style(*model, known) : ModelWords{.verdict = model.error().text()};
  } else {
    const auto model = gesture::parse_model(data, name);
    words = model ? words_of_gesture(*model) : ModelWords{.verdict = model.error().text()};
  }
  for (std::string* text : {&words.learnt, &words.skeleton, &words.verdict}) {
    *text = clean(*text, kMaxSentence);
  }
  return words;
}

}  // namespace posed::control
